//! Labels that people made: our own small text files, and the published ones of the PFNN's authors.
//!
//! Ours, one statement a line, times in seconds from the start of the file, `#` begins a comment:
//!
//! ```text
//! step right 1.233        # a foot comes down; within the first and last step given, only these count
//! gait walk 1.0 5.5       # from, to
//! skip 5.0 7.5            # not used
//! ```

use ambulo_features::GAITS;

use crate::gait::Gaits;
use crate::motion::Motion;
use crate::phase::{Phase, Step};

/// Longest label file, lines; a day of one line a frame.
const MOST_LINES: usize = 12_000_000;
/// Columns of a published `.gait` file, as places in [`GAITS`]: crawling counts as crouching.
const PUBLISHED_GAITS: [usize; 8] = [0, 1, 2, 3, 4, 5, 4, 6];

/// What a label file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    /// Seconds and side (0 left, 1 right), in order.
    pub steps: Vec<(f64, usize)>,
    /// Gait, from, to.
    pub gaits: Vec<(usize, f64, f64)>,
    /// From, to.
    pub skips: Vec<(f64, f64)>,
}

impl Given {
    /// Reads a label file.
    ///
    /// # Errors
    /// The line and what was expected there.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut given = Self::default();
        for (index, line) in text.lines().enumerate().take(MOST_LINES) {
            let line = line.split('#').next().unwrap_or_default();
            let words: Vec<&str> = line.split_whitespace().collect();
            let fail = |expected: &str| Err(format!("line {}: expected {expected}", index + 1));
            let time = |word: &str| {
                let time = word.parse::<f64>().ok().filter(|time| (0.0..1e6).contains(time));
                time.ok_or_else(|| format!("line {}: '{word}' is no time in seconds", index + 1))
            };
            let span = |from: &str, to: &str| {
                let (from, to) = (time(from)?, time(to)?);
                let order = format!("line {}: the span ends before it begins", index + 1);
                if from < to { Ok((from, to)) } else { Err(order) }
            };
            match words[..] {
                [] => {}
                ["step", "left", at] => given.steps.push((time(at)?, 0)),
                ["step", "right", at] => given.steps.push((time(at)?, 1)),
                ["gait", name, from, to] => match GAITS.iter().position(|gait| *gait == name) {
                    Some(gait) => {
                        let (from, to) = span(from, to)?;
                        given.gaits.push((gait, from, to));
                    }
                    None => return fail(&format!("one of {}", GAITS.join(", "))),
                },
                ["skip", from, to] => given.skips.push(span(from, to)?),
                _ => return fail("'step left|right T', 'gait NAME FROM TO' or 'skip FROM TO'"),
            }
        }
        given.steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(given)
    }

    /// Found steps, but for the time that is given by hand.
    pub fn steps(&self, found: Vec<Step>, fps: f32) -> Vec<Step> {
        let (Some(first), Some(last)) = (self.steps.first(), self.steps.last()) else {
            return found;
        };
        let frame = |seconds: f64| (seconds * f64::from(fps)) as f32;
        let (from, to) = (frame(first.0), frame(last.0));
        let given = self.steps.iter().map(|&(at, side)| Step { frame: frame(at), side });
        let outside = found.into_iter().filter(|step| step.frame < from || step.frame > to);
        let mut steps: Vec<Step> = outside.chain(given).collect();
        steps.sort_by(|a, b| a.frame.total_cmp(&b.frame));
        steps
    }

    /// Gaits by frame, `None` where none is given.
    pub fn gaits(&self, frames: usize, fps: f32) -> Vec<Option<usize>> {
        let mut gaits = vec![None; frames];
        for &(gait, from, to) in &self.gaits {
            let frame = |seconds: f64| ((seconds * f64::from(fps)).round() as usize).min(frames);
            gaits[frame(from)..frame(to)].iter_mut().for_each(|g| *g = Some(gait));
        }
        gaits
    }

    /// Whether a frame is left out.
    pub fn skips(&self, frame: usize, fps: f32) -> bool {
        let at = frame as f64 / f64::from(fps);
        self.skips.iter().any(|&(from, to)| (from..to).contains(&at))
    }

    /// The same for a clip that begins so many seconds into the file.
    pub fn from(&self, start: f64) -> Self {
        let span = |from: f64, to: f64| ((from - start).max(0.0), (to - start).max(0.0));
        let gait = |&(gait, from, to): &(usize, f64, f64)| {
            let (from, to) = span(from, to);
            (gait, from, to)
        };
        let steps = self.steps.iter().map(|&(at, side)| (at - start, side));
        Self {
            steps: steps.filter(|(at, _)| *at >= 0.0).collect(),
            gaits: self.gaits.iter().map(gait).collect(),
            skips: self.skips.iter().map(|&(from, to)| span(from, to)).collect(),
        }
    }

    /// The same for the mirrored clip.
    pub fn mirrored(&self) -> Self {
        let steps = self.steps.iter().map(|&(at, side)| (at, 1 - side)).collect();
        Self { steps, ..self.clone() }
    }
}

/// Labels as the PFNN's authors publish them, at their clip's own rate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Published {
    /// One number in [0, 1) a frame.
    pub phase: Vec<f32>,
    /// Shares in the order of [`GAITS`], one row a frame.
    pub gaits: Vec<[f32; GAITS.len()]>,
    /// Cycles: the right foot comes down, the left one does, the right one again (frames from 0).
    pub cycles: Vec<[f64; 3]>,
}

impl Published {
    /// Reads a `.phase` file.
    ///
    /// # Errors
    /// The line and what was expected there.
    pub fn parse_phase(text: &str) -> Result<Vec<f32>, String> {
        let line = |(index, line): (usize, &str)| {
            let phase = line.trim().parse::<f32>().ok().filter(|p| (0.0..=1.0).contains(p));
            phase.ok_or_else(|| format!("line {}: expected a phase from 0 to 1", index + 1))
        };
        filled(text).map(line).collect()
    }

    /// Reads a `.gait` file.
    ///
    /// # Errors
    /// The line and what was expected there.
    pub fn parse_gaits(text: &str) -> Result<Vec<[f32; GAITS.len()]>, String> {
        let line = |(index, line): (usize, &str)| {
            let fail = || format!("line {}: expected 8 shares from 0 to 1", index + 1);
            let words: Vec<f32> = line
                .split_whitespace()
                .map(|word| word.parse().ok().filter(|s| (-1e-3..=1.001).contains(s)))
                .collect::<Option<_>>()
                .ok_or_else(fail)?;
            if words.len() != PUBLISHED_GAITS.len() {
                return Err(fail());
            }
            let mut shares = [0.0; GAITS.len()];
            PUBLISHED_GAITS.iter().zip(words).for_each(|(&gait, share)| shares[gait] += share);
            Ok(shares)
        };
        filled(text).map(line).collect()
    }

    /// Reads a `_footsteps.txt` file: one cycle a line, `a b` or `a b *`, and a last `a`; a and b are frames, from
    /// 1, at which the right and the left foot come down. A cycle ends at the next line's a; it is
    /// left out if its own or the next line is starred.
    ///
    /// # Errors
    /// The line and what was expected there.
    pub fn parse_footsteps(text: &str) -> Result<Vec<[f64; 3]>, String> {
        let line = |(index, line): (usize, &str)| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let frame = |word: &str| word.parse::<f64>().ok().filter(|f| (0.0..1e9).contains(f));
            let parsed = match words[..] {
                [a, b] => frame(a).zip(frame(b)).map(|(a, b)| (a, b, false)),
                // The last line may only end the cycle before it.
                [a] => frame(a).map(|a| (a, a, false)),
                [a, b, "*"] => frame(a).zip(frame(b)).map(|(a, b)| (a, b, true)),
                _ => None,
            };
            parsed.ok_or_else(|| {
                format!(
                    "line {}: expected 'FRAME FRAME', 'FRAME FRAME *' or a last 'FRAME'",
                    index + 1
                )
            })
        };
        let lines: Vec<(f64, f64, bool)> = filled(text).map(line).collect::<Result<_, _>>()?;
        let pairs = lines.windows(2).filter(|w| !w[0].2 && !w[1].2);
        let cycles = pairs.map(|w| [w[0].0, w[0].1, w[1].0].map(|frame| frame - 1.0));
        Ok(cycles.filter(|c| c[0] < c[1] && c[1] < c[2]).collect())
    }

    /// The same for a clip that begins so many frames into the file.
    pub fn from(&self, start: f64) -> Self {
        let first = start.round() as usize;
        Self {
            phase: self.phase.get(first..).unwrap_or_default().to_vec(),
            gaits: self.gaits.get(first..).unwrap_or_default().to_vec(),
            cycles: self.cycles.iter().map(|cycle| cycle.map(|at| at - start)).collect(),
        }
    }

    /// Phase at a motion's own rate: through the cycles, known within them. For the mirrored clip
    /// left and right change places: the phase is half a cycle on.
    pub fn phase(&self, frames: usize, fps: f32, file_fps: f64, mirrored: bool) -> Phase {
        let shift = if mirrored { 0.5 } else { 0.0 };
        let mut phase = Phase { cycles: vec![0.0; frames], known: vec![false; frames] };
        let mut before = 0.0f64;
        for frame in 0..frames {
            let at = self.row(frame, fps, file_fps).min(self.phase.len().saturating_sub(1));
            let value = f64::from(self.phase.get(at).copied().unwrap_or_default()) + shift;
            // The nearest number of whole cycles that makes it go on from the frame before.
            let on = (value - before).rem_euclid(1.0);
            let on = if on > 0.75 && frame > 0 { on - 1.0 } else { on };
            before += on;
            phase.cycles[frame] = before;
            let file_frame = frame as f64 * file_fps / f64::from(fps);
            phase.known[frame] = self.cycles.iter().any(|c| (c[0]..c[2]).contains(&file_frame));
        }
        phase
    }

    /// Gaits at a motion's own rate.
    pub fn gaits(&self, motion: &Motion, file_fps: f64) -> Gaits {
        let row = |frame: usize| {
            let at =
                self.row(frame, motion.fps(), file_fps).min(self.gaits.len().saturating_sub(1));
            self.gaits.get(at).copied().unwrap_or_default()
        };
        Gaits::given((0..motion.frames()).map(row).collect(), motion)
    }

    fn row(&self, frame: usize, fps: f32, file_fps: f64) -> usize {
        (frame as f64 * file_fps / f64::from(fps)).round() as usize
    }
}

/// Lines that are not blank, with their indices.
fn filled(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().take(MOST_LINES).filter(|(_, line)| !line.trim().is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_read_and_refused_by_line() {
        let given =
            Given::parse("# mine\nstep right 2.5\nstep left 2\ngait jog 1 3 # fast\n\nskip 4 5");
        let given = given.unwrap();
        assert_eq!(given.steps, [(2.0, 0), (2.5, 1)]);
        assert_eq!(given.gaits(240, 60.0)[59..61], [None, Some(2)]);
        assert!(given.skips(250, 60.0) && !given.skips(300, 60.0));
        assert_eq!(given.mirrored().steps[0], (2.0, 1));
        let refused = |text: &str| Given::parse(text).unwrap_err();
        assert!(refused("step right 1\nstep up 2").starts_with("line 2: expected 'step"));
        assert!(refused("gait trot 1 2").contains("stand, walk"));
        assert!(refused("skip 3 2").contains("ends before"));
        assert!(refused("step left NaN").contains("no time"));
    }

    #[test]
    fn given_steps_replace_what_was_found_between_them() {
        let found = |frame: usize| Step { frame: frame as f32, side: 0 };
        let given = Given { steps: vec![(1.0, 1), (2.0, 0)], ..Given::default() };
        let steps = given.steps(vec![found(30), found(90), found(150)], 60.0);
        let frames: Vec<f32> = steps.iter().map(|s| s.frame).collect();
        assert_eq!(frames, [30.0, 60.0, 120.0, 150.0]);
    }

    #[test]
    fn published_files() {
        let cycles = Published::parse_footsteps("11 31\n51 71\n91 111 *\n131 151\n171\n");
        assert_eq!(cycles.unwrap(), [[10.0, 30.0, 50.0], [130.0, 150.0, 170.0]]);
        assert!(Published::parse_footsteps("1 2\n3 x").unwrap_err().starts_with("line 2"));
        let gaits = Published::parse_gaits("0 0.5 0 0 0.25 0 0.25 0\n").unwrap();
        assert_eq!(gaits[0], [0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 0.0]);
        assert!(Published::parse_gaits("0 1").is_err() && Published::parse_phase("2").is_err());
    }

    #[test]
    fn published_phase_unwraps_and_mirrors() {
        let phase = (0..240).map(|i| (i % 120) as f32 / 120.0).collect();
        let published = Published { phase, gaits: vec![], cycles: vec![[0.0, 60.0, 120.0]] };
        let phase = published.phase(120, 60.0, 120.0, false);
        assert!((phase.cycles[90] - 1.5).abs() < 1e-6 && phase.known[30] && !phase.known[61]);
        let other = published.phase(120, 60.0, 120.0, true);
        assert!((other.at(0) - 0.5).abs() < 1e-6 && (other.at(45) - 0.25).abs() < 1e-6);
    }
}
