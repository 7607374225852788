//! How far automatic labels agree with those that people made.

use std::f64::consts::TAU;

use ambulo_features::gait::{BUMP, JOG, RUN};
use serde::{Deserialize, Serialize};

use crate::gait::strongest;
use crate::labels::Labels;

/// Agreement over one clip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Mean distance on the circle between the two phases, cycles, where both are known and the
    /// character does not stand.
    pub phase_error: f64,
    /// Frames that this is the mean of.
    pub phase_frames: usize,
    /// Circular mean of the difference, automatic less given, cycles: a constant shift.
    pub phase_shift: f64,
    /// Share of the frames of labelled cycles with the same strongest gait, jog and run taken for
    /// one.
    pub gait_agreement: f64,
    /// Frames that this is the share of.
    pub gait_frames: usize,
    /// The same for all frames. Published gaits are key frames that say little outside of cycles:
    /// the last one holds to the end of the clip, whatever happens there.
    pub gait_agreement_everywhere: f64,
}

/// Which labels people gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judged {
    /// Where in the gait cycle.
    pub phase: bool,
    /// Which gait.
    pub gaits: bool,
}

/// Compares labels that were found with labels that were given; what was not given has no frames.
pub fn compare(given: &Labels, found: &Labels, what: Judged) -> Agreement {
    let merged = |labels: &Labels, frame: usize| {
        let mut shares = labels.gaits.shares[frame];
        shares[JOG] += std::mem::take(&mut shares[RUN]);
        strongest(&shares)
    };
    let (mut errors, mut frames, mut turn) = (0.0, 0, (0.0, 0.0));
    let (mut same, mut judged) = ([0, 0], [0, 0]);
    for frame in 0..given.usable.len() {
        let gait = merged(given, frame);
        if what.phase && given.phase.known[frame] && found.phase.known[frame] && gait != 0 {
            let off = found.phase.cycles[frame] - given.phase.cycles[frame];
            let off = off - off.round();
            errors += off.abs();
            frames += 1;
            turn.0 += (TAU * off).sin();
            turn.1 += (TAU * off).cos();
        }
        // Bumping into people is not a gait that a body alone tells.
        if what.gaits && gait != BUMP {
            let (within, agrees) = (given.phase.known[frame], gait == merged(found, frame));
            judged = [judged[0] + u32::from(within), judged[1] + 1];
            same = [same[0] + u32::from(within && agrees), same[1] + u32::from(agrees)];
        }
    }
    Agreement {
        phase_error: errors / f64::from(frames.max(1)),
        phase_frames: frames as usize,
        phase_shift: f64::atan2(turn.0, turn.1) / TAU,
        gait_agreement: f64::from(same[0]) / f64::from(judged[0].max(1)),
        gait_frames: judged[0] as usize,
        gait_agreement_everywhere: f64::from(same[1]) / f64::from(judged[1].max(1)),
    }
}
