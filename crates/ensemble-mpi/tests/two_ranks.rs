//! `ensemble_mpi` on several ranks (`cargo test --release`): the output has the bytes of one process, also after a rank
//! was killed; invalid input ends all ranks.

// A failed precondition fails the test.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

const BINARY: &str = env!("CARGO_BIN_EXE_ensemble_mpi");

/// The time limit of a run, on a machine with other load; a hang is a failure.
const DEADLINE: Duration = Duration::from_secs(180);

/// One job at a time, since each has work for two cores.
static JOB: Mutex<()> = Mutex::new(());

/// A directory for one test, and the lock for starting jobs.
struct Folder(PathBuf, #[expect(dead_code, reason = "held until the test ends")] MutexGuard<'static, ()>);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ensemble-mpi-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        // A failed test must not make others fail.
        Folder(path, JOB.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().into()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Starts a job: the number of ranks of each program, with its arguments separated by spaces.
fn start(programs: &[(usize, &str)]) -> Child {
    let mut command = Command::new("mpirun");
    command.args(["--allow-run-as-root", "--oversubscribe", "--bind-to", "none"]);
    for (i, (ranks, arguments)) in programs.iter().enumerate() {
        if i > 0 {
            command.arg(":");
        }
        command.args(["-np", &ranks.to_string(), BINARY]).args(arguments.split_whitespace());
    }
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn finish(mut job: Child) -> Output {
    let begin = Instant::now();
    while job.try_wait().unwrap().is_none() {
        if begin.elapsed() > DEADLINE {
            job.kill().unwrap();
            panic!("the job hangs: {:?}", job.wait_with_output());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    job.wait_with_output().unwrap()
}

fn completed(ranks: usize, arguments: &str) -> String {
    let output = finish(start(&[(ranks, arguments)]));
    assert!(output.status.success(), "{arguments}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The process id of a rank.
fn process_of(job: &Child, rank: usize) -> String {
    let children = fs::read_to_string(format!("/proc/{0}/task/{0}/children", job.id())).unwrap();
    let variable = format!("OMPI_COMM_WORLD_RANK={rank}");
    let is_it = |process: &&str| {
        let environment = fs::read(format!("/proc/{process}/environ")).unwrap();
        environment.split(|byte| *byte == 0).any(|entry| entry == variable.as_bytes())
    };
    children.split_whitespace().find(is_it).unwrap().into()
}

/// Waits until a checkpoint has some shards, and then sends a signal to rank 1.
fn signal_in_mid_run(job: &mut Child, checkpoint: &str, signal: &str) {
    let begin = Instant::now();
    while shards_of(Path::new(checkpoint)) < 5 {
        assert!(begin.elapsed() < DEADLINE && job.try_wait().unwrap().is_none(), "it ended before it could be killed");
        std::thread::sleep(Duration::from_millis(5));
    }
    let sent = Command::new("kill").args([signal, &process_of(job, 1)]).status().unwrap();
    assert!(sent.success());
}

/// The number of complete shards in a checkpoint. After a header of four words, each shard has its length, that many
/// words, and their digest.
fn shards_of(checkpoint: &Path) -> usize {
    let bytes = fs::read(checkpoint).unwrap_or_default();
    let (mut at, mut shards) = (32, 0);
    while let Some(word) = bytes.get(at..at + 8) {
        at += 8 * (u64::from_le_bytes(word.try_into().unwrap()) as usize + 2);
        shards += usize::from(at <= bytes.len());
    }
    shards
}

#[test]
fn any_number_of_ranks_gives_the_bytes_of_one() {
    let folder = Folder::new("ranks");
    for method in ["blanes_moan_6", "gauss_5"] {
        // The last of 14 shards is not full.
        let arguments = format!("--members 5000 --steps 2000 --method {method} --rates --out");
        let of = |ranks: usize| {
            let out = folder.file(&format!("{method}_{ranks}.csv"));
            let said = completed(ranks, &format!("{arguments} {out}"));
            assert!(said.contains("5000 members: 5000 completed, 0 failed"), "{said}");
            if ranks > 1 {
                let shards = said.split_once("shards by rank: [").unwrap().1.split_once(']').unwrap().0;
                let shards: Vec<usize> = shards.split(", ").map(|count| count.parse().unwrap()).collect();
                assert_eq!((shards.len(), shards.iter().sum::<usize>()), (ranks, 14), "{said}");
                assert!(shards.iter().all(|count| *count > 0), "a rank has not worked: {said}");
            }
            fs::read(out).unwrap()
        };
        let one = of(1);
        assert_eq!(one.iter().filter(|byte| **byte == b'\n').count(), 5001);
        for ranks in [2, 3] {
            assert!(of(ranks) == one, "{method}, {ranks} ranks");
        }
    }
}

/// Long enough to be interrupted: 79 shards.
const LONG: &str = "--members 30000 --steps 4000";

#[test]
fn a_rank_that_is_killed_costs_its_open_shards_only() {
    let folder = Folder::new("killed");
    let (plain, again, checkpoint) = (folder.file("plain.csv"), folder.file("again.csv"), folder.file("shards"));
    completed(1, &format!("{LONG} --out {plain}"));
    let resumed = format!("{LONG} --checkpoint {checkpoint} --out {again}");
    let mut job = start(&[(2, &resumed)]);
    signal_in_mid_run(&mut job, &checkpoint, "-KILL");
    let output = finish(job);
    assert!(!output.status.success(), "{output:?}");
    // The CSV file gets its name only when it is complete.
    assert!(!Path::new(&again).exists());
    let kept = shards_of(Path::new(&checkpoint));
    assert!((5..79).contains(&kept), "{kept} shards are kept: not killed in mid-run");
    let said = completed(2, &resumed);
    assert!(said.contains(&format!("{kept} shards read from the checkpoint")), "{said}");
    assert!(fs::read(&again).unwrap() == fs::read(&plain).unwrap());
    assert_eq!(shards_of(Path::new(&checkpoint)), 79);
    // One process reads the shards of two, in any order.
    let said = completed(1, &resumed);
    assert!(said.contains("79 shards read from the checkpoint"), "{said}");
    assert!(fs::read(&again).unwrap() == fs::read(&plain).unwrap());
}

#[test]
fn a_rank_that_is_silent_for_too_long_is_lost() {
    let folder = Folder::new("silent");
    let (out, checkpoint) = (folder.file("ends.csv"), folder.file("shards"));
    let mut job = start(&[(2, &format!("{LONG} --patience 2 --checkpoint {checkpoint} --out {out}"))]);
    signal_in_mid_run(&mut job, &checkpoint, "-STOP");
    let output = finish(job);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("rank 1 has sent no message for 2 s"), "{said}");
    assert!(shards_of(Path::new(&checkpoint)) >= 5 && !Path::new(&out).exists());
}

#[test]
fn what_is_refused_ends_all_ranks() {
    let folder = Folder::new("refused");
    let (out, checkpoint) = (folder.file("ends.csv"), folder.file("shards"));
    let refused = |programs: &[(usize, &str)], why: &str| {
        let programs: Vec<_> = programs.iter().map(|(n, of)| (*n, format!("{of} --steps 10 --out {out}"))).collect();
        let programs: Vec<_> = programs.iter().map(|(n, of)| (*n, of.as_str())).collect();
        let output = finish(start(&programs));
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{programs:?}: {said}");
        assert!(said.contains(why), "{programs:?}: {said}");
        assert!(!Path::new(&out).exists(), "{programs:?}");
    };
    refused(&[(2, "--members 0")], "the ensemble has no members");
    refused(&[(1, "--members 0")], "the ensemble has no members");
    refused(&[(2, "--time NaN")], "member 0: ");
    refused(&[(2, "--patience=-1")], "--patience");
    // Ranks that disagree, and a rank other than 0 that has nothing to run.
    refused(&[(1, "--time 6"), (1, "--time 7")], "rank 1 has a different ensemble from rank 0");
    refused(&[(2, ""), (1, "--time 7")], "rank 2 has a different ensemble from rank 0");
    refused(&[(1, ""), (1, "--members 0")], "rank 1: the ensemble has no members");
    // Checkpoints.
    let with = |more: &str| format!("--members 2000 --checkpoint {checkpoint} {more}");
    completed(2, &format!("{} --steps 10 --out {out}", with("")));
    fs::remove_file(&out).unwrap();
    refused(&[(2, &with("--time 7"))], "contains the shards of another ensemble");
    let mut bytes = fs::read(&checkpoint).unwrap();
    bytes[1000] ^= 1;
    fs::write(&checkpoint, &bytes).unwrap();
    refused(&[(2, &with(""))], "the checkpoint is damaged");
    fs::write(&checkpoint, "a letter to a friend, of no use here").unwrap();
    refused(&[(2, &with(""))], "the file is not a checkpoint");
    let nowhere = format!("--checkpoint {}", folder.0.join("missing").join("shards").display());
    refused(&[(2, &nowhere)], "the checkpoint cannot be read");
}
