//! A file of the shards that are done.

use super::member::{Ending, Member};
use super::{EnsembleError, Shard};
use crate::run::digest;
use crate::run::saved::{Saved, load_option, save_option, word};
use crate::{CheckpointError, InputError, Status, Suspicion};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;
use std::fs::{File, OpenOptions};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// What a file begins with, and the version of what follows.
const MAGIC: u64 = u64::from_le_bytes(*b"ensemble");
const VERSION: u64 = 1;

/// The words before the shards: those two, the fingerprint, and their digest.
const HEAD: usize = 4;

/// The words that a shard has at the most: what says more is damaged.
const LONGEST: u64 = 1 << 24;

/// The shards that are done, in their order, each whole or not there: it is written at once, behind those before it, with its length in front and a
/// digest at its end. What was cut off in the middle of it is the last of the file, and is done again.
pub(super) struct Shards {
    path: PathBuf,
    file: BufReader<File>,
    /// How much of the file is whole.
    whole: u64,
    length: u64,
}

impl Shards {
    /// Opens the file of an ensemble with this fingerprint, or begins it.
    pub fn open(path: &Path, fingerprint: u64) -> Result<Self, EnsembleError> {
        let shards = || -> Result<Self, CheckpointError> {
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
            let length = file.metadata()?.len();
            Ok(Shards { path: path.into(), file: BufReader::new(file), whole: 0, length })
        };
        let mut shards = shards().map_err(|cause| EnsembleError::checkpoint(path, cause))?;
        let head = [MAGIC, VERSION, fingerprint];
        if shards.length == 0 {
            shards.append(&head)?;
            return Ok(shards);
        }
        let found = shards.words(HEAD).map_err(|cause| shards.error(cause))?;
        let cause = match found.as_slice() {
            [MAGIC, VERSION, other, sum] if *sum == digest(&[MAGIC, VERSION, *other]) => {
                if *other == fingerprint {
                    shards.whole = 8 * HEAD as u64;
                    return Ok(shards);
                }
                return Err(EnsembleError::AnotherEnsemble { path: path.into() });
            }
            [MAGIC, found, ..] if *found != VERSION => CheckpointError::Version { found: *found },
            [MAGIC, ..] => CheckpointError::Damaged,
            _ => CheckpointError::Foreign,
        };
        Err(shards.error(cause))
    }

    fn error(&self, cause: CheckpointError) -> EnsembleError {
        EnsembleError::checkpoint(&self.path, cause)
    }

    /// So many words more, or as many as there are.
    fn words(&mut self, count: usize) -> Result<Vec<u64>, CheckpointError> {
        let mut bytes = Vec::new();
        self.file.by_ref().take(8 * count as u64).read_to_end(&mut bytes)?;
        Ok(bytes.chunks_exact(8).map(|c| u64::from_le_bytes(c.try_into().unwrap_or_default())).collect())
    }

    /// Appends words with their digest.
    fn append(&mut self, words: &[u64]) -> Result<(), EnsembleError> {
        let bytes: Vec<u8> = words.iter().copied().chain([digest(words)]).flat_map(u64::to_le_bytes).collect();
        let whole = self.whole;
        let file = self.file.get_mut();
        let mut write = || -> std::io::Result<()> {
            file.seek(SeekFrom::Start(whole))?;
            file.write_all(&bytes)?;
            file.flush()
        };
        write().map_err(|cause| EnsembleError::checkpoint(&self.path, cause.into()))?;
        self.whole += bytes.len() as u64;
        Ok(())
    }

    /// The next shard that is done; `None` after the last, behind which others may then be written.
    pub fn next<const N: usize>(&mut self, shard: usize, first: usize) -> Result<Option<Shard<N>>, EnsembleError> {
        let next = self.next_words().map_err(|cause| self.error(cause))?;
        let Some(words) = next else {
            // What is left of a shard that was not written to its end.
            let cut = self.file.get_mut().set_len(self.whole);
            return cut.map(|()| None).map_err(|cause| self.error(cause.into()));
        };
        let shard = read(&words, shard, first).ok_or_else(|| self.error(CheckpointError::Damaged))?;
        Ok(Some(shard))
    }

    /// The words of the next shard; `None` where it is not there, or not to its end.
    fn next_words(&mut self) -> Result<Option<Vec<u64>>, CheckpointError> {
        let [count] = self.words(1)?[..] else { return Ok(None) };
        if count > LONGEST {
            return Err(CheckpointError::Damaged);
        }
        let end = self.whole + 8 * (count + 2);
        if end > self.length {
            return Ok(None);
        }
        let mut words = vec![count];
        words.extend(self.words(count as usize + 1)?);
        if words.pop() != Some(digest(&words)) {
            return Err(CheckpointError::Damaged);
        }
        self.whole = end;
        Ok(Some(words.split_off(1)))
    }

    /// Writes a shard behind the others.
    pub fn write<const N: usize>(&mut self, shard: usize, of: &Shard<N>) -> Result<(), EnsembleError> {
        let mut words = vec![0, shard as u64];
        of.in_lanes.save(&mut words);
        of.members.len().save(&mut words);
        for member in &of.members {
            let completed = member.ending.ok().filter(|ending| ending.status == Status::Completed);
            completed.is_some().save(&mut words);
            if let Some(Ending { suspicion, steps, t, state, .. }) = completed {
                save_option(suspicion.as_ref(), &mut words);
                steps.save(&mut words);
                t.save(&mut words);
                state.save(&mut words);
            }
        }
        let count = words.len() as u64 - 1;
        if let Some(first) = words.first_mut() {
            *first = count;
        }
        self.append(&words)
    }
}

/// A shard from its words; members that have not completed are those which [`Task`](super::Task) runs again.
fn read<const N: usize>(mut from: &[u64], shard: usize, first: usize) -> Option<Shard<N>> {
    let from = &mut from;
    let (mut in_lanes, mut count) = (0, 0);
    if word(from)? != shard as u64 {
        return None;
    }
    in_lanes.load(from)?;
    count.load(from)?;
    if count > super::SHARD {
        return None;
    }
    let mut members = Vec::with_capacity(count);
    for place in 0..count {
        let mut completed = false;
        completed.load(from)?;
        let ending = if completed {
            let suspicion = load_option(from, || Suspicion { step: 0, misfit: 0.0 })?;
            let (mut steps, mut t) = (0, 0.0);
            let mut state = PhasePoint { q: SVector::zeros(), p: SVector::zeros(), z: 0.0 };
            steps.load(from)?;
            t.load(from)?;
            state.load(from)?;
            Ok(Ending { status: Status::Completed, suspicion, steps, t, state })
        } else {
            Err(InputError::NoSteps)
        };
        members.push(Member { index: first + place, ending });
    }
    from.is_empty().then_some(Shard { members, in_lanes })
}
