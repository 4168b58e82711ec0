//! The checkpoints of `herglotz run`: a file from which a run that was interrupted or killed is resumed.

use crate::failure::Failure;
use crate::output::Directory;
use herglotz::runtime::Plan;
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::time::{Duration, Instant};

const FILE: &str = "checkpoint.json";

/// The content of a checkpoint: the state of a run, and the lengths of its output files at that state. Both are in one
/// file, so that they always belong to the same step.
#[derive(Serialize, Deserialize)]
pub(crate) struct Checkpoint {
    /// The fingerprint of the scene.
    scene: String,
    pub integrator: String,
    pub count: usize,
    pub in_transformed_time: bool,
    pub taken: usize,
    pub written: Written,
    /// The bytes of a [`ResumeState`](herglotz::runtime::ResumeState), or of a
    /// [`BodyResumeState`](herglotz::runtime::BodyResumeState).
    state: Vec<u8>,
}

/// The lengths of the output files.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Written {
    pub rows: usize,
    pub rows_bytes: u64,
    pub events: usize,
    pub events_bytes: u64,
}

impl Checkpoint {
    /// Reads the checkpoint of a directory, for a scene with a fingerprint.
    pub fn read(directory: &Directory, scene: &str) -> Result<Self, Failure> {
        let path = directory.file(FILE);
        let refuse = |why: &str| Failure::Input(format!("{}: {why}", path.display()));
        let text = std::fs::read_to_string(&path)
            .map_err(|_| refuse("there is no interrupted run in this directory; run without --resume"))?;
        let read: Checkpoint =
            serde_json::from_str(&text).map_err(|_| refuse("the checkpoint is damaged; run without --resume"))?;
        if read.scene != scene {
            return Err(refuse("the scene differs from that of the interrupted run; run without --resume"));
        }
        Ok(read)
    }

    /// The state from which the run is resumed.
    pub fn state<T, E: Display>(
        &self,
        directory: &Directory,
        from_bytes: fn(&[u8]) -> Result<T, E>,
    ) -> Result<T, Failure> {
        from_bytes(&self.state).map_err(|error| Failure::Input(format!("{}: {error}", directory.file(FILE).display())))
    }

    /// Removes the checkpoint of a directory.
    pub fn remove(directory: &Directory) -> Result<(), Failure> {
        directory.remove(FILE)
    }
}

/// Writes the checkpoints of a run.
pub(crate) struct CheckpointWriter {
    directory: Directory,
    scene: String,
    integrator: String,
    count: usize,
    in_transformed_time: bool,
    every: Duration,
    last: Instant,
}

impl CheckpointWriter {
    /// Checkpoints of a scene with a fingerprint, in a directory at an interval of time.
    pub fn new(directory: &Directory, scene: String, plan: &Plan, every: Duration) -> Self {
        CheckpointWriter {
            directory: directory.clone(),
            scene,
            integrator: plan.integrator.name.to_string(),
            count: plan.steps,
            in_transformed_time: plan.integrator.in_transformed_time,
            every,
            last: Instant::now(),
        }
    }

    /// Whether the next checkpoint is due.
    pub fn is_due(&self) -> bool {
        self.last.elapsed() >= self.every
    }

    /// Saves the state after a number of steps.
    pub fn save(&mut self, taken: usize, written: Written, state: &[u8]) -> Result<(), Failure> {
        let CheckpointWriter { scene, integrator, count, in_transformed_time, .. } = &*self;
        let checkpoint = Checkpoint {
            scene: scene.clone(),
            integrator: integrator.clone(),
            count: *count,
            in_transformed_time: *in_transformed_time,
            taken,
            written,
            state: state.to_vec(),
        };
        let text = serde_json::to_string(&checkpoint).map_err(std::io::Error::from)?;
        self.directory.replace(FILE, &text)?;
        self.last = Instant::now();
        Ok(())
    }
}
