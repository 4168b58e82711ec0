//! An ensemble of damped pendula on MPI ranks: `mpirun -np 2 ensemble_mpi`.
//!
//! `L = v^2/2 - (1 - cos q) - z/100`; angle and velocity of each member are random numbers seeded with its index.
//! Writes a CSV file with the final states of the members or their means, with 17 digits each: the same bytes for any
//! number of ranks, and for runs that were killed and resumed from the checkpoint. The exit code is 2 where the input
//! is refused, a checkpoint cannot be used or a rank is lost, and 1 where the CSV file cannot be written.

use clap::Parser;
use contact_examples::systems::Pendulum;
use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, Ensemble, Status, Steps, Until, ensemble::Member};
use ensemble_mpi::{MpiError, run};
use mpi::topology::Communicator;
use std::fmt::Arguments as Text;
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
    /// The seed of the random initial states, in addition to the index.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// A file with the shards that are done, from which the run is resumed.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// The file for the final states.
    #[arg(long, value_name = "FILE", default_value = "ensemble_mpi.csv")]
    out: PathBuf,
    /// Write only the means of the final states.
    #[arg(long)]
    means: bool,
    /// How many seconds to wait for the next shard of a rank; by default without limit.
    #[arg(long, value_name = "SECONDS")]
    patience: Option<u64>,
    /// Print statistics of what rank 0 has handed out and received.
    #[arg(long)]
    rates: bool,
}

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014) at an index: a number in `[-1, 1)`.
fn random(seed: u64, index: u64) -> f64 {
    let mixed = |x: u64| {
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let word = mixed(mixed(seed).wrapping_add((index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    (word >> 11) as f64 * f64::EPSILON - 1.0
}

/// The final states of members, or their means, as lines of a file that gets its name when it is complete.
struct Table {
    part: PathBuf,
    /// Created with the first line, so that no file is left where the ensemble is refused.
    file: Option<BufWriter<File>>,
    means: bool,
    /// The number of members that completed, and the sums of their q, p and z.
    completed: (usize, [f64; 3]),
}

impl Table {
    fn line(&mut self, line: Text<'_>) -> io::Result<()> {
        if self.file.is_none() {
            self.file = Some(BufWriter::new(File::create(&self.part)?));
            self.line(format_args!("{}", if self.means { "members,q,p,z" } else { "index,status,t,q,p,z" }))?;
        }
        self.file.as_mut().map_or(Ok(()), |file| writeln!(file, "{line}"))
    }

    fn row(&mut self, Member { index, ending, .. }: &Member<1>) -> io::Result<()> {
        let end = match ending {
            Ok(end) => end,
            Err(_) if self.means => return Ok(()),
            Err(cause) => return self.line(format_args!("{index},\"{cause}\",,,,")),
        };
        let x = [end.state.q[0], end.state.p[0], end.state.z];
        if !self.means {
            let (status, t, [q, p, z]) = (end.status, end.t, x);
            return self.line(format_args!("{index},\"{status}\",{t:.16e},{q:.16e},{p:.16e},{z:.16e}"));
        }
        if end.status == Status::Completed {
            self.completed.0 += 1;
            self.completed.1.iter_mut().zip(x).for_each(|(sum, x)| *sum += x);
        }
        Ok(())
    }

    fn finish(mut self, path: &Path) -> io::Result<()> {
        if self.means {
            let (count, sums) = self.completed;
            let [q, p, z] = sums.map(|sum| sum / count as f64);
            self.line(format_args!("{count},{q:.16e},{p:.16e},{z:.16e}"))?;
        }
        self.file.as_mut().map_or(Ok(()), BufWriter::flush)?;
        std::fs::rename(self.part, path)
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let Some(universe) = mpi::initialize() else {
        eprintln!("error: the MPI library is already initialized");
        return ExitCode::from(2);
    };
    let world = universe.world();
    let pendulum = Pendulum { gamma: -0.01 };
    let start = |index: usize| {
        let number = |k: u64| random(arguments.seed, 2 * index as u64 + k);
        VelocityPoint::new([2.0 * number(0)], [number(1)], 0.0)
    };
    let mut ensemble = Ensemble::new(&pendulum, 0.0, arguments.members, start)
        .by(arguments.method)
        .steps(Steps::Count(arguments.steps));
    if let Some(path) = &arguments.checkpoint {
        ensemble = ensemble.checkpoint(path);
    }
    let mut part = arguments.out.clone().into_os_string();
    part.push(".part");
    let mut table = Table { part: part.into(), file: None, means: arguments.means, completed: (0, [0.0; 3]) };
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
                eprintln!("error: rank {}: {cause}", world.rank());
            }
            if matches!(cause, MpiError::RankLost { .. }) {
                world.abort(2);
            }
            return ExitCode::from(2);
        }
    };
    if let Err(cause) = written.and_then(|()| table.finish(&arguments.out)) {
        eprintln!("error: {}: {cause}", arguments.out.display());
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
