//! An ensemble of damped pendula on MPI ranks.
//!
//! ```text
//! mpirun -np 2 ensemble_mpi [--members N --time T --steps K --method NAME --seed I --checkpoint FILE --out FILE --means
//!     --patience S --rates]
//! ```
//!
//! `L = v^2/2 - (1 - cos q) - z/100`; angle and velocity of each member are random numbers seeded with its index.
//! Writes a CSV file with the final states of the members or their means, with 17 digits each: the same bytes for any
//! number of ranks, and for runs that were killed and resumed from the checkpoint. The exit code is 2 where the input
//! is refused, a checkpoint cannot be used or a rank is lost, and 1 where the CSV file cannot be written.

use clap::Parser;
use contact_examples::systems::Pendulum;
use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, Ensemble, Status, Steps, Until, ensemble::Member};
use ensemble_mpi::{Merged, MpiError, Options, run};
use mpi::topology::Communicator;
use std::cell::Cell;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
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
    patience: Option<f64>,
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
    path: PathBuf,
    file: BufWriter<File>,
    /// The number of members that completed and the sums of their q, p and z, where only the means are requested.
    sums: Option<(usize, [f64; 3])>,
}

impl Table {
    fn partial(path: &std::path::Path) -> PathBuf {
        let mut name = path.as_os_str().to_owned();
        name.push(".part");
        name.into()
    }

    fn create(path: PathBuf, means: bool) -> std::io::Result<Self> {
        let mut file = BufWriter::new(File::create(Self::partial(&path))?);
        writeln!(file, "{}", if means { "members,q,p,z" } else { "index,status,t,q,p,z" })?;
        Ok(Table { path, file, sums: means.then_some((0, [0.0; 3])) })
    }

    fn row(&mut self, member: &Member<1>) -> std::io::Result<()> {
        if let Some((count, sums)) = &mut self.sums {
            if let Ok(end) = member.ending
                && end.status == Status::Completed
            {
                *count += 1;
                for (sum, x) in sums.iter_mut().zip([end.state.q[0], end.state.p[0], end.state.z]) {
                    *sum += x;
                }
            }
            return Ok(());
        }
        match member.ending {
            Ok(end) => {
                let (index, [t, q, p, z]) = (member.index, [end.t, end.state.q[0], end.state.p[0], end.state.z]);
                writeln!(self.file, "{index},\"{}\",{t:.16e},{q:.16e},{p:.16e},{z:.16e}", end.status)
            }
            Err(cause) => writeln!(self.file, "{},\"{cause}\",,,,", member.index),
        }
    }

    fn finish(mut self) -> std::io::Result<()> {
        if let Some((count, sums)) = self.sums {
            match count {
                0 => writeln!(self.file, "0,,,")?,
                _ => {
                    let [q, p, z] = sums.map(|sum| sum / count as f64);
                    writeln!(self.file, "{count},{q:.16e},{p:.16e},{z:.16e}")?;
                }
            }
        }
        self.file.flush()?;
        std::fs::rename(Self::partial(&self.path), self.path)
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let Some(universe) = mpi::initialize() else {
        eprintln!("error: the MPI library is already initialized");
        return ExitCode::from(2);
    };
    let world = universe.world();
    let is_root = world.rank() == 0;
    let fail = |message: &dyn std::fmt::Display, code: u8| {
        if is_root {
            eprintln!("error: {message}");
        }
        ExitCode::from(code)
    };
    let patience = match arguments.patience.map(Duration::try_from_secs_f64).transpose() {
        Ok(patience) => patience,
        Err(cause) => return fail(&format!("--patience: {cause}; give a number of seconds"), 2),
    };

    let pendulum = Pendulum { gamma: -0.01 };
    let start = |index: usize| {
        let number = |k: u64| random(arguments.seed, 2 * index as u64 + k);
        VelocityPoint::new([2.0 * number(0)], [number(1)], 0.0)
    };
    let tenths = Cell::new(0);
    let mut ensemble = Ensemble::new(&pendulum, 0.0, arguments.members, start)
        .by(arguments.method)
        .steps(Steps::Count(arguments.steps))
        .progress(|part| {
            if (10.0 * part) as u32 > tenths.replace((10.0 * part) as u32) {
                eprintln!("{:3.0} %", 100.0 * part);
            }
        });
    if let Some(path) = &arguments.checkpoint {
        ensemble = ensemble.checkpoint(path);
    }
    // Created with the first member, so that no file is left where the ensemble is refused.
    let mut table: Option<std::io::Result<Table>> = None;
    let clock = Instant::now();
    let merged = run(&world, &ensemble, Until::Time(arguments.time), Options { patience }, |member| {
        let open = table.get_or_insert_with(|| Table::create(arguments.out.clone(), arguments.means));
        if let Ok(rows) = open
            && let Err(cause) = rows.row(member)
        {
            *open = Err(cause);
        }
    });
    let merged = match merged {
        Ok(Some(merged)) => merged,
        Ok(None) => return ExitCode::SUCCESS,
        Err(lost @ MpiError::RankLost { .. }) => {
            eprintln!("error: {lost}");
            world.abort(2);
        }
        Err(cause) => return fail(&cause, 2),
    };
    if let Some(Err(cause)) = table.map(|table| table.and_then(Table::finish)) {
        return fail(&format!("{}: {cause}", arguments.out.display()), 1);
    }
    report(&merged, clock.elapsed(), arguments.rates);
    ExitCode::SUCCESS
}

fn report(Merged { tally, resumed, traffic, .. }: &Merged, elapsed: Duration, rates: bool) {
    println!("{} members: {} completed, {} failed", tally.members, tally.completed, tally.failed);
    println!("{resumed} shards read from the checkpoint");
    if !rates {
        return;
    }
    println!("total time: {:.3} s", elapsed.as_secs_f64());
    println!("shards by rank: {:?}", traffic.shards);
    let all: usize = traffic.shards.iter().sum();
    let received: usize = traffic.shards.iter().skip(1).sum();
    let micro = |time: Duration, count: usize| 1e6 * time.as_secs_f64() / count.max(1) as f64;
    println!("bytes of a shard received: {}", traffic.bytes / received.max(1));
    println!("microseconds of rank 0 to receive a shard and assign the next: {:.1}", micro(traffic.messages, received));
    println!("microseconds of rank 0 to merge a shard: {:.1}", micro(traffic.merging, all));
}
