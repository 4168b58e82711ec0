//! The state of an interrupted run, and its file format.

use crate::UnresolvedStep;
use crate::numbers::state_words::{Saved, digest, load_option, save_option, word};
use crate::run::checks::energy_drift::EnergySums;
use std::io::Write;
use std::path::Path;
use thiserror::Error;

/// The first word of a checkpoint file, and the version of its format.
const MAGIC: u64 = u64::from_le_bytes(*b"herglotz");
const VERSION: u64 = 4;

/// The reason why a file cannot be used as a checkpoint.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file cannot be read.
    #[error("the checkpoint cannot be read: {0}")]
    Unreadable(#[from] std::io::Error),
    /// The file is of another kind.
    #[error("the file is not a checkpoint of a run; give a file that `Checkpoint` has written")]
    Foreign,
    /// The file has another version of the format.
    #[error(
        "the checkpoint has version {found}, but this library reads version {VERSION}; resume with the library that \
         wrote it"
    )]
    Version {
        /// The version of the file.
        found: u64,
    },
    /// The file is damaged or incomplete.
    #[error("the checkpoint is damaged; start the run again, or resume from another checkpoint")]
    Damaged,
}

/// The state of an interrupted run, for [`Run::resume`](crate::run::Run::resume).
#[derive(Clone, Debug, PartialEq)]
pub struct ResumeState {
    /// A digest that identifies the run; see [`Plan`](crate::run::Plan).
    pub(crate) fingerprint: u64,
    pub(crate) taken: usize,
    pub(crate) log_factor: f64,
    pub(crate) unresolved: Option<UnresolvedStep>,
    pub(crate) energy: EnergySums,
    /// If the motion had come to rest, the time until which it was followed.
    pub(crate) rested_until: Option<f64>,
    /// The saved words of the stepper.
    pub(crate) words: Vec<u64>,
}

impl ResumeState {
    /// Reads the file of a [`Checkpoint`](crate::Checkpoint).
    ///
    /// # Errors
    /// A [`CheckpointError`] if the file is not a checkpoint of a run.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, CheckpointError> {
        Self::from_bytes(&std::fs::read(path)?)
    }

    /// Decodes the result of [`to_bytes`](Self::to_bytes).
    ///
    /// # Errors
    /// A [`CheckpointError`] if the bytes do not encode an interrupted run.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let words: Vec<u64> =
            bytes.chunks_exact(8).map(|c| u64::from_le_bytes(c.try_into().unwrap_or_default())).collect();
        match words.as_slice() {
            [MAGIC, VERSION, body @ .., sum] if bytes.len().is_multiple_of(8) && *sum == digest(body) => {
                Self::of(body).ok_or(CheckpointError::Damaged)
            }
            [MAGIC, found, ..] if *found != VERSION => Err(CheckpointError::Version { found: *found }),
            [MAGIC, ..] => Err(CheckpointError::Damaged),
            _ => Err(CheckpointError::Foreign),
        }
    }

    fn of(mut from: &[u64]) -> Option<Self> {
        let fingerprint = word(&mut from)?;
        let (mut taken, mut log_factor) = (0, 0.0);
        Saved::load(&mut taken, &mut from)?;
        Saved::load(&mut log_factor, &mut from)?;
        let unresolved = load_option(&mut from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        let mut energy = EnergySums::default();
        Saved::load(&mut energy, &mut from)?;
        let rested_until = load_option(&mut from, || 0.0)?;
        Some(ResumeState { fingerprint, taken, log_factor, unresolved, energy, rested_until, words: from.to_vec() })
    }

    /// Encodes the state as bytes, with a digest, for [`from_bytes`](Self::from_bytes): the contents of a checkpoint
    /// file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut body = vec![self.fingerprint];
        self.taken.save(&mut body);
        self.log_factor.save(&mut body);
        save_option(self.unresolved.as_ref(), &mut body);
        self.energy.save(&mut body);
        save_option(self.rested_until.as_ref(), &mut body);
        body.extend_from_slice(&self.words);
        let sum = digest(&body);
        let words = [MAGIC, VERSION].into_iter().chain(body).chain([sum]);
        words.flat_map(u64::to_le_bytes).collect()
    }

    /// Writes a file atomically, for [`read`](Self::read): a temporary file is renamed after it has been written
    /// completely.
    ///
    /// # Errors
    /// An I/O error.
    pub fn write(&self, path: impl AsRef<Path>) -> std::io::Result<()> {
        let path = path.as_ref();
        let part = path.with_extension("part");
        let mut file = std::fs::File::create(&part)?;
        file.write_all(&self.to_bytes())?;
        file.sync_all()?;
        std::fs::rename(part, path)
    }
}
