//! An ensemble of damped pendula on MPI ranks: `mpirun -np 2 ensemble_mpi`.
//!
//! `L = v^2/2 - (1 - cos q) - z/100`; angle and velocity of each member are random numbers seeded with its index.
//! Writes a CSV file with the final states of the members, with 17 digits each: the same bytes for any number of ranks,
//! and for runs that were resumed from the checkpoint. The exit code is 2 where the input is refused, a checkpoint
//! cannot be used or a rank is lost, and 1 where the CSV file cannot be written.

use clap::Parser;
use contact_examples::systems::Pendulum;
use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, Ensemble, Steps, Until, ensemble::Member};
use ensemble_mpi::{MpiError, run};
use mpi::topology::Communicator;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Runs an ensemble of damped pendula on MPI ranks.
#[derive(Parser)]
struct Arguments {
    /// The number of pendula.
    #[arg(long, default_value_t = 100_000)]
    members: usize,
    /// The final time.
    #[arg(long, default_value_t = 100.0)]
    time: f64,
    /// The number of steps of each.
    #[arg(long, default_value_t = 400)]
    steps: usize,
    /// The integrator.
    #[arg(long, default_value = "blanes_moan_6")]
    method: AnyIntegrator,
    /// A file with the shards that are done, from which the run is resumed.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// The file for the final states.
    #[arg(long, value_name = "FILE", default_value = "ensemble_mpi.csv")]
    out: PathBuf,
    /// How many seconds to wait for the next shard of a rank; by default without limit.
    #[arg(long, value_name = "SECONDS")]
    patience: Option<u64>,
    /// Print statistics of what rank 0 has handed out and received.
    #[arg(long)]
    rates: bool,
}

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014) at an index: a number in `[-1, 1)`.
fn random(index: u64) -> f64 {
    let x = (index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 * f64::EPSILON - 1.0
}

/// The final states of members as lines of a file that gets its name when it is complete.
struct Table {
    part: PathBuf,
    /// Created with the first member, so that no file is left where the ensemble is refused.
    file: Option<BufWriter<File>>,
}

impl Table {
    fn row(&mut self, Member { index, ending, .. }: &Member) -> io::Result<()> {
        if self.file.is_none() {
            writeln!(self.file.insert(BufWriter::new(File::create(&self.part)?)), "index,status,t,q,p,z")?;
        }
        let Some(file) = &mut self.file else { return Ok(()) };
        match ending {
            Ok(end) => {
                let (status, [t, q, p, z]) = (end.status, [end.t, end.state.q[0], end.state.p[0], end.state.z]);
                writeln!(file, "{index},\"{status}\",{t:.16e},{q:.16e},{p:.16e},{z:.16e}")
            }
            Err(cause) => writeln!(file, "{index},\"{cause}\",,,,"),
        }
    }

    fn finish(mut self, path: &Path) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), BufWriter::flush)?;
        std::fs::rename(self.part, path)
    }
}

/// Writes a message to stderr at once, so that those of several ranks are not mixed.
fn report(message: &str) {
    // The message is lost if stderr is closed.
    let _ = io::stderr().write_all(message.as_bytes());
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let Some(universe) = mpi::initialize() else { return ExitCode::from(2) };
    let world = universe.world();
    let pendulum = Pendulum { gamma: -0.01 };
    let start = |index: usize| {
        let index = 2 * index as u64;
        VelocityPoint::new([2.0 * random(index)], [random(index + 1)], 0.0)
    };
    let mut ensemble = Ensemble::new(&pendulum, 0.0, arguments.members, start)
        .by(arguments.method)
        .steps(Steps::Count(arguments.steps));
    if let Some(path) = &arguments.checkpoint {
        ensemble = ensemble.checkpoint(path);
    }
    let mut part = arguments.out.clone().into_os_string();
    part.push(".part");
    let mut table = Table { part: part.into(), file: None };
    let (clock, mut written) = (Instant::now(), Ok(()));
    let merged =
        run(&world, &ensemble, Until::Time(arguments.time), arguments.patience.map(Duration::from_secs), |member| {
            if written.is_ok() {
                written = table.row(member);
            }
        });
    let merged = match merged {
        Ok(Some(merged)) => merged,
        Ok(None) => return ExitCode::SUCCESS,
        Err(cause) => {
            if world.rank() == 0 || matches!(cause, MpiError::Ensemble(_)) {
                report(&format!("error: rank {}: {cause}\n", world.rank()));
            }
            if matches!(cause, MpiError::RankLost { .. }) {
                world.abort(2);
            }
            return ExitCode::from(2);
        }
    };
    if let Err(cause) = written.and_then(|()| table.finish(&arguments.out)) {
        report(&format!("error: {}: {cause}\n", arguments.out.display()));
        return ExitCode::FAILURE;
    }
    let tally = merged.tally;
    println!("{} members: {} completed, {} failed", tally.members, tally.completed, tally.failed);
    println!("{} shards read from the checkpoint", merged.resumed);
    if arguments.rates {
        println!("total time: {:.3} s", clock.elapsed().as_secs_f64());
        println!("shards by rank: {:?}", merged.shards);
        let all: usize = merged.shards.iter().sum();
        let received = (all - merged.shards[0]).max(1);
        let micro = |time: Duration, count: usize| 1e6 * time.as_secs_f64() / count.max(1) as f64;
        println!("bytes of a shard received: {}", merged.bytes / received);
        println!(
            "microseconds of rank 0 to receive a shard and assign the next: {:.1}",
            micro(merged.messages, received)
        );
        println!("microseconds of rank 0 to merge a shard: {:.1}", micro(merged.merging, all));
    }
    ExitCode::SUCCESS
}
