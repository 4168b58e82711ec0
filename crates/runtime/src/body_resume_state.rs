//! States from which motions of rigid bodies are resumed.

use crate::RuntimeError;
use discrete_herglotz::{CheckpointError, InputError};
use std::fmt::Write;

/// The first word of the encoding, and the version of its format.
const MAGIC: u64 = u64::from_le_bytes(*b"rotation");
const VERSION: u64 = 1;

/// The number of numbers of a saved motion.
const SAVED: usize = 26;

/// The state of an interrupted motion of a rigid body, for [`Body::resume`](crate::Body::resume): the rest of the motion is the same to the
/// last bit.
///
/// ```
/// use herglotz_runtime::{Body, BodyMotion, BodyResumeState, RunMonitor, StepControl, Steps};
/// use std::ops::ControlFlow;
/// #[derive(Default)]
/// struct Half(Option<BodyResumeState>);
/// impl RunMonitor for Half {
///     fn poll(&mut self, part: f64) -> ControlFlow<()> {
///         if part >= 0.5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
///     }
///     fn body_interrupted(&mut self, at: BodyResumeState) {
///         self.0 = Some(at);
///     }
/// }
/// let body = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() };
/// let steps = StepControl::Steps { by: "sofroniou_spaletta_10".parse()?, steps: Steps::Count(1000) };
/// let motion = BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 1.0 / 3.0], 10.0, steps);
/// let mut half = Half::default();
/// body.run(&motion, &mut half)?;
/// let at = BodyResumeState::from_bytes(&half.0.expect("it was interrupted").to_bytes())?;
/// assert_eq!(body.resume(&motion, at, &mut ())?, body.run(&motion, &mut ())?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct BodyResumeState {
    /// A digest of the body, the motion and its steps.
    fingerprint: u64,
    /// The steps taken.
    pub(crate) taken: usize,
    /// The rows passed on, of those at given times.
    pub(crate) rows: usize,
    /// The saved motion.
    pub(crate) numbers: [f64; SAVED],
}

/// The FNV-1a hash of what is written to it.
pub(crate) struct Digest(pub u64);

impl Digest {
    pub fn new() -> Self {
        Digest(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, byte: u8) {
        self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
}

impl Write for Digest {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        text.bytes().for_each(|byte| self.add(byte));
        Ok(())
    }
}

/// The digest of words.
fn digest(words: &[u64]) -> u64 {
    let mut digest = Digest::new();
    words.iter().flat_map(|word| word.to_le_bytes()).for_each(|byte| digest.add(byte));
    digest.0
}

impl BodyResumeState {
    pub(crate) fn new(fingerprint: u64, taken: usize, rows: usize, numbers: [f64; SAVED]) -> Self {
        BodyResumeState { fingerprint, taken, rows, numbers }
    }

    /// Refuses the state of another motion.
    pub(crate) fn check(&self, fingerprint: u64) -> Result<(), RuntimeError> {
        if self.fingerprint == fingerprint {
            return Ok(());
        }
        Err(InputError::AnotherRun.into())
    }

    /// The number of steps that were taken.
    pub fn taken(&self) -> usize {
        self.taken
    }

    /// Encodes the state as bytes, with a digest, for [`from_bytes`](Self::from_bytes).
    pub fn to_bytes(&self) -> Vec<u8> {
        let counts = [self.fingerprint, self.taken as u64, self.rows as u64];
        let body: Vec<u64> = counts.into_iter().chain(self.numbers.map(f64::to_bits)).collect();
        let sum = digest(&body);
        [MAGIC, VERSION].into_iter().chain(body).chain([sum]).flat_map(u64::to_le_bytes).collect()
    }

    /// Decodes the result of [`to_bytes`](Self::to_bytes).
    ///
    /// # Errors
    /// [`RuntimeError::Checkpoint`] if the bytes do not encode a motion of a rigid body.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RuntimeError> {
        let words: Vec<u64> =
            bytes.chunks_exact(8).map(|c| u64::from_le_bytes(c.try_into().unwrap_or_default())).collect();
        let damaged = RuntimeError::Checkpoint(CheckpointError::Damaged);
        match words.as_slice() {
            [MAGIC, VERSION, body @ .., sum] if bytes.len().is_multiple_of(8) && *sum == digest(body) => {
                let [fingerprint, taken, rows, numbers @ ..] = body else { return Err(damaged) };
                let numbers: Vec<f64> = numbers.iter().map(|bits| f64::from_bits(*bits)).collect();
                let numbers: [f64; SAVED] = numbers.try_into().map_err(|_| damaged)?;
                Ok(BodyResumeState { fingerprint: *fingerprint, taken: *taken as usize, rows: *rows as usize, numbers })
            }
            [MAGIC, found, ..] if *found != VERSION => Err(CheckpointError::Version { found: *found }.into()),
            [MAGIC, ..] => Err(damaged),
            _ => Err(CheckpointError::Foreign.into()),
        }
    }
}
