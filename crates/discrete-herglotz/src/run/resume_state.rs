//! A run where it was interrupted, as data.

use crate::UnresolvedStep;
use crate::numbers::state_words::{Saved, digest, load_option, save_option, word};
use crate::run::checks::energy_drift::EnergySums;
use std::io::Write;
use std::path::Path;
use thiserror::Error;

/// What a file of a checkpoint begins with, and the version of what follows.
const MAGIC: u64 = u64::from_le_bytes(*b"herglotz");
const VERSION: u64 = 3;

/// Why a file is no checkpoint.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// It cannot be read.
    #[error("the checkpoint cannot be read: {0}")]
    Unreadable(#[from] std::io::Error),
    /// It is another kind of file.
    #[error("the file is no checkpoint of a run; give one that `Checkpoint` has written")]
    Foreign,
    /// Another version of the library has written it.
    #[error(
        "the checkpoint has version {found}, where this library reads {VERSION}; go on with the library that wrote it"
    )]
    Version {
        /// Its version.
        found: u64,
    },
    /// It is damaged, or was not written to its end.
    #[error("the checkpoint is damaged; start the run anew, or from another checkpoint")]
    Damaged,
}

/// A run where it was interrupted, for [`Run::resume`](crate::run::Run::resume).
#[derive(Clone, Debug, PartialEq)]
pub struct ResumeState {
    /// What the run is; see [`Plan`](crate::run::Plan).
    pub(crate) fingerprint: u64,
    pub(crate) taken: usize,
    pub(crate) log_factor: f64,
    pub(crate) unresolved: Option<UnresolvedStep>,
    pub(crate) energy: EnergySums,
    /// The stepper's own.
    pub(crate) words: Vec<u64>,
}

impl ResumeState {
    /// From the file of a [`Checkpoint`].
    ///
    /// # Errors
    /// A [`CheckpointError`] where it is not one of a run.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, CheckpointError> {
        Self::from_bytes(&std::fs::read(path)?)
    }

    /// From what [`to_bytes`](Self::to_bytes) has made.
    ///
    /// # Errors
    /// A [`CheckpointError`] where the bytes are not those of a run.
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
        Some(ResumeState { fingerprint, taken, log_factor, unresolved, energy, words: from.to_vec() })
    }

    /// As bytes, with their digest, for [`from_bytes`](Self::from_bytes): the contents of a checkpoint's file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut body = vec![self.fingerprint];
        self.taken.save(&mut body);
        self.log_factor.save(&mut body);
        save_option(self.unresolved.as_ref(), &mut body);
        self.energy.save(&mut body);
        body.extend_from_slice(&self.words);
        let sum = digest(&body);
        let words = [MAGIC, VERSION].into_iter().chain(body).chain([sum]);
        words.flat_map(u64::to_le_bytes).collect()
    }

    /// To a file that is there whole or not at all, for [`read`](Self::read).
    ///
    /// # Errors
    /// Those of the file.
    pub fn write(&self, path: impl AsRef<Path>) -> std::io::Result<()> {
        let path = path.as_ref();
        let part = path.with_extension("part");
        let mut file = std::fs::File::create(&part)?;
        file.write_all(&self.to_bytes())?;
        file.sync_all()?;
        std::fs::rename(part, path)
    }
}
