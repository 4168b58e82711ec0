//! Scene files, and the formulas in them: errors have their position, and a scene that is read has a motion and its
//! members.

#![no_main]

use herglotz::Scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| match Scene::read(text) {
    Ok(scene) => {
        let members = scene.members();
        assert_eq!(scene.motion().start.q.len(), scene.system.dimension());
        assert!(members.count() == 0 || members.values(0).len() == scene.swept.len());
    }
    Err(error) => assert!(error.to_string().contains("line "), "{error}"),
});
