//! The checkpoint file of an ensemble: the completed shards.

use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Ending, Member};
use crate::ensemble::task::{MEMBERS_PER_SHARD, Shard};
use crate::numbers::state_words::digest;
use crate::numbers::state_words::{Saved, load_option, save_option};
use crate::{CheckpointError, InputError, Row, State, Status, UnresolvedStep, Vector};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The first word of the file, and the version of its format.
const MAGIC: u64 = u64::from_le_bytes(*b"ensemble");
const VERSION: u64 = 2;

/// The number of words before the shards: these two, the fingerprint, and their digest.
const HEADER_WORDS: usize = 4;

/// The largest number of words of a shard; a larger number, of more than sixteen gigabytes, means that the file is
/// damaged.
const MAX_SHARD_WORDS: u64 = 1 << 31;

/// The completed shards, in any order. A shard is appended as a whole, with its length before it and a digest at its
/// end. If a write was cut off, the incomplete shard is the last in the file, and is computed again.
pub(crate) struct Shards {
    path: PathBuf,
    file: BufReader<File>,
    /// The length of the intact part of the file, in bytes.
    whole: u64,
    length: u64,
    /// The position of each shard: the byte after its length, and the number of its words before the digest.
    places: BTreeMap<usize, (u64, usize)>,
}

impl Shards {
    /// Opens the file of an ensemble with this fingerprint and number of shards, or creates it.
    pub fn open(path: &Path, fingerprint: u64, count: usize) -> Result<Self, EnsembleError> {
        let shards = || -> Result<Self, CheckpointError> {
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
            let length = file.metadata()?.len();
            let (path, file) = (path.into(), BufReader::new(file));
            Ok(Shards { path, file, whole: 0, length, places: BTreeMap::new() })
        };
        let mut shards = shards().map_err(|cause| EnsembleError::checkpoint(path, cause))?;
        let head = [MAGIC, VERSION, fingerprint];
        if shards.length == 0 {
            shards.append(&head)?;
            return Ok(shards);
        }
        let found = shards.words(HEADER_WORDS).map_err(|cause| shards.error(cause))?;
        let cause = match found.as_slice() {
            [MAGIC, VERSION, other, sum] if *sum == digest(&[MAGIC, VERSION, *other]) => {
                if *other == fingerprint {
                    shards.whole = 8 * HEADER_WORDS as u64;
                    shards.find(count).map_err(|cause| shards.error(cause))?;
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

    /// Finds all shards after the head, and truncates the file after the last complete one.
    fn find(&mut self, count: usize) -> Result<(), CheckpointError> {
        while let Some(words) = self.next_words()? {
            let Some(shard) = words.first().and_then(|word| usize::try_from(*word).ok()).filter(|s| *s < count) else {
                return Err(CheckpointError::Damaged);
            };
            // The digest follows the words.
            let place = self.whole - 8 * (words.len() as u64 + 1);
            self.places.insert(shard, (place, words.len()));
        }
        Ok(self.file.get_mut().set_len(self.whole)?)
    }

    /// Whether the file has a shard.
    pub fn has(&self, shard: usize) -> bool {
        self.places.contains_key(&shard)
    }

    fn error(&self, cause: CheckpointError) -> EnsembleError {
        EnsembleError::checkpoint(&self.path, cause)
    }

    /// Reads the next `count` words, or fewer at the end of the file.
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

    /// Reads a shard with this number of members, in n coordinates, if the file has it.
    pub fn read(&mut self, shard: usize, (members, n): (usize, usize)) -> Result<Option<Shard>, EnsembleError> {
        let Some((place, count)) = self.places.get(&shard).copied() else { return Ok(None) };
        let words = match self.file.seek(SeekFrom::Start(place)) {
            Ok(_) => self.words(count),
            Err(cause) => Err(cause.into()),
        };
        let words = words.map_err(|cause| self.error(cause))?;
        match shard_of(&words, n) {
            Some((found, of)) if found == shard && of.members.len() == members => Ok(Some(of)),
            _ => Err(self.error(CheckpointError::Damaged)),
        }
    }

    /// The words of the next shard; `None` at the end of the file, or if the shard is incomplete.
    fn next_words(&mut self) -> Result<Option<Vec<u64>>, CheckpointError> {
        let [count] = self.words(1)?[..] else { return Ok(None) };
        if count > MAX_SHARD_WORDS {
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

    /// Appends a shard.
    pub fn write(&mut self, shard: usize, of: &Shard) -> Result<(), EnsembleError> {
        let mut words = words_of(shard, of);
        let (place, count) = (self.whole + 8, words.len());
        words.insert(0, count as u64);
        self.append(&words)?;
        self.places.insert(shard, (place, count));
        Ok(())
    }
}

/// Encodes a shard as words, its number first. For a member that has not completed only this fact is encoded.
pub(crate) fn words_of(shard: usize, of: &Shard) -> Vec<u64> {
    let mut words = vec![shard as u64];
    of.batch_kernel.save(&mut words);
    of.members.len().save(&mut words);
    for member in &of.members {
        let completed = member.ending.as_ref().ok().filter(|ending| ending.status == Status::Completed);
        completed.is_some().save(&mut words);
        if let Some(Ending { unresolved, steps, t, state, .. }) = completed {
            save_option(unresolved.as_ref(), &mut words);
            steps.save(&mut words);
            t.save(&mut words);
            state.q.save(&mut words);
            state.p.save(&mut words);
            state.z.save(&mut words);
            save_rows(&member.rows, &mut words);
        }
    }
    words
}

/// Decodes a shard in n coordinates and its number from words; members that have not completed are run again by [`Task`](super::Task).
pub(crate) fn shard_of(mut from: &[u64], n: usize) -> Option<(usize, Shard)> {
    let from = &mut from;
    let (mut shard, mut batch_kernel, mut count) = (0usize, 0, 0);
    shard.load(from)?;
    batch_kernel.load(from)?;
    count.load(from)?;
    let first = shard.checked_mul(MEMBERS_PER_SHARD)?;
    if count > MEMBERS_PER_SHARD {
        return None;
    }
    let mut members = Vec::with_capacity(count);
    for place in 0..count {
        let (mut completed, mut rows) = (false, Vec::new());
        completed.load(from)?;
        let ending = if completed {
            let unresolved = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
            let (mut steps, mut t) = (0, 0.0);
            let mut state = State { q: Vector::zeros(n), p: Vector::zeros(n), z: 0.0 };
            steps.load(from)?;
            t.load(from)?;
            state.q.load(from)?;
            state.p.load(from)?;
            state.z.load(from)?;
            rows = load_rows(from, n)?;
            Ok(Ending { status: Status::Completed, unresolved, steps, t, state })
        } else {
            Err(InputError::NoSteps)
        };
        members.push(Member { index: first.checked_add(place)?, ending, rows });
    }
    from.is_empty().then_some((shard, Shard { members, batch_kernel, with_causes: false }))
}

fn save_rows(rows: &[Row], to: &mut Vec<u64>) {
    rows.len().save(to);
    for Row { t, q, p, z, .. } in rows {
        t.save(to);
        q.save(to);
        p.save(to);
        save_option(z.as_ref(), to);
    }
}

fn load_rows(from: &mut &[u64], n: usize) -> Option<Vec<Row>> {
    let mut count = 0;
    count.load(from)?;
    // A row has at least one word.
    let mut rows = Vec::with_capacity(from.len().min(count));
    for _ in 0..count {
        let (mut t, mut q, mut p) = (0.0, Vector::zeros(n), Vector::zeros(n));
        t.load(from)?;
        q.load(from)?;
        p.load(from)?;
        let z = load_option(from, || 0.0)?;
        rows.push(Row { t, q, v: None, p, z, energy: None, log_factor: None, columns: Vec::new() });
    }
    Some(rows)
}
