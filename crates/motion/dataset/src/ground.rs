//! Ground under a captured motion: pieces of terrain that its feet fit.
//!
//! Source: section 4.2 of the PFNN paper. For every gait cycle the patches are ranked by how well
//! the feet stand on them while in contact and stay above them while not; the best ones are bent by
//! radial basis functions so that they meet the standing feet.

use ambulo_rig::Terrain;
use ambulo_rig::glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::contacts::Contacts;
use crate::filter::stretches;
use crate::motion::Motion;
use crate::patches::{Patch, Patches};
use crate::random::Random;

/// What a clip was captured on; decides what a patch is judged by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A level floor: no patch is fitted.
    Flat,
    /// Anything uneven.
    Rocky,
    /// As rocky, and the ground is just below feet in the air: jumps over something.
    Jumpy,
    /// As rocky, and there is nothing beside the path.
    Beam,
}

impl Kind {
    /// The kinds of the published clips, by name; the first match wins.
    pub fn published(name: &str) -> Option<Self> {
        const KINDS: [(&str, Kind); 8] = [
            ("LocomotionFlat12", Kind::Jumpy),
            ("NewCaptures03", Kind::Jumpy),
            ("NewCaptures04", Kind::Jumpy),
            ("LocomotionFlat", Kind::Flat),
            ("NewCaptures01", Kind::Flat),
            ("NewCaptures02", Kind::Flat),
            ("WalkingUpSteps06", Kind::Beam),
            ("WalkingUpSteps", Kind::Rocky),
        ];
        let flat_steps = ["WalkingUpSteps09", "WalkingUpSteps10", "WalkingUpSteps11"];
        if flat_steps.iter().any(|steps| name.starts_with(steps)) {
            return Some(Kind::Flat);
        }
        let known =
            KINDS.iter().find(|(prefix, _)| name.starts_with(prefix)).map(|(_, kind)| *kind);
        known.or_else(|| name.starts_with("NewCaptures").then_some(Kind::Rocky))
    }
}

/// A bilinear patch, moved to the feet and bent to meet them.
#[derive(Clone, Debug)]
pub enum Ground<'a> {
    /// A height everywhere.
    Flat(f32),
    /// A patch.
    Fitted {
        /// What it is made of.
        patch: Patch<'a>,
        /// Where the patch's middle lies.
        middle: Vec2,
        /// Added to the patch's heights.
        rise: f32,
        /// What bends it.
        bend: Bend,
    },
}

impl Terrain for Ground<'_> {
    fn height(&self, x: f32, z: f32) -> f32 {
        match self {
            Self::Flat(height) => *height,
            Self::Fitted { patch, middle, rise, bend } => {
                let at = Vec2::new(x, z) - middle;
                patch.height(at) + rise + bend.at(at)
            }
        }
    }
}

/// Radial basis functions with a linear kernel, scaled by the mean distance of their centres.
#[derive(Clone, Debug)]
pub struct Bend {
    centres: Vec<Vec2>,
    weights: Vec<f32>,
    scale: f32,
}

/// Smoothing of the bend, relative to the mean distance. The published 0.1 leaves standing feet up
/// to 2 cm off the ground; at this value all of them meet it.
const SMOOTHING: f64 = 0.002;

impl Bend {
    /// Solves (K/μ − s·I)·c = residual, K the distances and μ their mean.
    fn new(centres: Vec<Vec2>, residual: &[f32]) -> Self {
        let count = centres.len();
        let distance = |a: usize, b: usize| f64::from(centres[a].distance(centres[b]));
        let pairs = (0..count).flat_map(|a| (0..count).map(move |b| (a, b)));
        let mean = pairs.clone().map(|(a, b)| distance(a, b)).sum::<f64>() / (count * count) as f64;
        if mean.is_nan() || mean < 1e-6 {
            // One place only: nothing to bend between.
            return Self { centres: vec![], weights: vec![], scale: 1.0 };
        }
        let mut matrix: Vec<Vec<f64>> = (0..count)
            .map(|a| {
                let smooth = |b: usize| if a == b { SMOOTHING } else { 0.0 };
                let row = (0..count).map(|b| distance(a, b) / mean - smooth(b));
                row.chain([f64::from(residual[a])]).collect()
            })
            .collect();
        let weights = solve(&mut matrix).unwrap_or_else(|| vec![0.0; count]);
        let weights = weights.into_iter().map(|w| w as f32).collect();
        Self { centres, weights, scale: (1.0 / mean) as f32 }
    }

    fn at(&self, place: Vec2) -> f32 {
        let terms = self.centres.iter().zip(&self.weights);
        terms.map(|(centre, weight)| weight * place.distance(*centre) * self.scale).sum()
    }
}

/// Gaussian elimination with pivoting on an augmented matrix; `None` if it is singular.
fn solve(rows: &mut [Vec<f64>]) -> Option<Vec<f64>> {
    let count = rows.len();
    for column in 0..count {
        let size = |row: &usize| rows[*row][column].abs();
        let pivot = (column..count).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        if rows[pivot][column].abs() < 1e-12 {
            return None;
        }
        rows.swap(column, pivot);
        let (top, rest) = rows.split_at_mut(column + 1);
        let pivot = &top[column];
        for row in rest {
            let factor = row[column] / pivot[column];
            row[column..].iter_mut().zip(&pivot[column..]).for_each(|(x, p)| *x -= factor * p);
        }
    }
    let mut solution = vec![0.0; count];
    for row in (0..count).rev() {
        let known: f64 = (row + 1..count).map(|c| rows[row][c] * solution[c]).sum();
        solution[row] = (rows[row][count] - known) / rows[row][row];
    }
    Some(solution)
}

/// Where soles are in a stretch of a motion: standing, and in the air.
#[derive(Clone, Debug, Default)]
pub struct Soles {
    /// One point for each time that a sole stands: its mean place.
    down: Vec<Vec3>,
    /// For how many frames.
    frames: Vec<f32>,
    up: Vec<Vec3>,
    hips: Vec<Vec3>,
}

impl Soles {
    /// Gathers the points of some frames; `heights` are those of heel and toe joints above the
    /// ground while they stand.
    pub fn gather(
        motion: &Motion,
        contacts: &Contacts,
        soles: [usize; 4],
        heights: [f32; 4],
        frames: std::ops::Range<usize>,
        hips: usize,
    ) -> Self {
        let mut gathered = Self::default();
        for (index, joint) in soles.into_iter().enumerate() {
            let point = |frame: usize| motion.position(frame, joint) - Vec3::Y * heights[index];
            let on = |at: usize| contacts.soles[frames.start + at][index];
            for stand in stretches(frames.len(), on) {
                let count = stand.len() as f32;
                let sum: Vec3 = stand.map(|at| point(frames.start + at)).sum();
                gathered.down.push(sum / count);
                gathered.frames.push(count);
            }
            // A third of the frames tell as much.
            let up = frames.clone().step_by(3).filter(|&frame| !contacts.soles[frame][index]);
            gathered.up.extend(up.map(point));
        }
        gathered.hips.extend(frames.step_by(3).map(|frame| motion.position(frame, hips)));
        gathered
    }

    /// Mean places of soles while they stand.
    pub fn standing(&self) -> &[Vec3] {
        &self.down
    }

    /// The ground as the standing feet have it, if it is level: each frame counts alike.
    pub fn level(&self) -> f32 {
        self.mean(|point| point.y)
    }

    /// Mean over the frames of the standing feet; 0 without any.
    fn mean(&self, value: impl Fn(&Vec3) -> f32) -> f32 {
        let terms = self.down.iter().zip(&self.frames);
        let sum: f32 = terms.map(|(point, frames)| value(point) * frames).sum();
        sum / self.frames.iter().sum::<f32>().max(1.0)
    }

    /// The grounds that fit best, the best first.
    pub fn fit<'a>(
        &self,
        patches: &'a Patches,
        kind: Kind,
        count: usize,
        random: &mut Random,
    ) -> Vec<Ground<'a>> {
        if kind == Kind::Flat || self.down.is_empty() || patches.is_empty() {
            return vec![Ground::Flat(self.level()); count];
        }
        let middle = self.down.iter().map(ground).sum::<Vec2>() / self.down.len() as f32;
        let beside: Vec<(Vec2, Vec2)> =
            if kind == Kind::Beam { self.beside(random) } else { vec![] };
        let error = |index: usize| self.error(patches.get(index), middle, kind, &beside);
        let mut ranked: Vec<(f32, usize)> = (0..patches.len()).map(|i| (error(i), i)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let bent = |&(_, index): &(f32, usize)| self.bent(patches.get(index), middle);
        ranked.iter().cycle().take(count).map(bent).collect()
    }

    /// Random points off the path, with the hips beside which they lie.
    fn beside(&self, random: &mut Random) -> Vec<(Vec2, Vec2)> {
        let hips: Vec<Vec2> = self.hips.iter().map(ground).collect();
        let point = |&at: &Vec2| (at + 0.5 * Vec2::new(random.normal(), random.normal()), at);
        let points: Vec<_> = hips.iter().map(point).collect();
        let far = |(point, _): &(Vec2, Vec2)| hips.iter().all(|at| at.distance(*point) > 0.15);
        points.into_iter().filter(far).collect()
    }

    /// How badly a patch fits (PFNN, equations 4 to 7; the weights are the published ones). The
    /// published errors are in centimetres; all terms are squares, so metres rank the same.
    fn error(&self, patch: Patch<'_>, middle: Vec2, kind: Kind, beside: &[(Vec2, Vec2)]) -> f32 {
        let height = |point: &Vec3| patch.height(ground(point) - middle);
        let mean_patch = self.mean(height);
        let mean_foot = self.level();
        // How far the ground is above a point.
        let above = |point: &Vec3| (height(point) - mean_patch) - (point.y - mean_foot);
        let mean = |terms: &mut dyn Iterator<Item = f32>| {
            let (sum, count) = terms.fold((0.0, 0), |(sum, count), term| (sum + term, count + 1));
            if count == 0 { 0.0 } else { sum / count as f32 }
        };
        let stand = mean(&mut self.down.iter().map(|p| above(p).powi(2)));
        let mut error = 0.1 * stand + mean(&mut self.up.iter().map(|p| above(p).max(0.0).powi(2)));
        if kind == Kind::Jumpy {
            error += mean(&mut self.up.iter().map(|p| (-above(p) - 0.05).max(0.0).powi(2)));
        }
        let drop = |(point, hips): &(Vec2, Vec2)| {
            let [point, hips] = [point, hips].map(|at| patch.height(*at - middle));
            (point - (hips - 0.4)).max(0.0).powi(2)
        };
        error + mean(&mut beside.iter().map(drop))
    }

    fn bent<'a>(&self, patch: Patch<'a>, middle: Vec2) -> Ground<'a> {
        let centres: Vec<Vec2> = self.down.iter().map(|point| ground(point) - middle).collect();
        let heights: Vec<f32> = centres.iter().map(|&at| patch.height(at)).collect();
        let rise = self.mean(|point| point.y - patch.height(ground(point) - middle));
        let points = self.down.iter().zip(&heights);
        let residual: Vec<f32> = points.map(|(point, height)| point.y - height - rise).collect();
        Ground::Fitted { patch, middle, rise, bend: Bend::new(centres, &residual) }
    }
}

fn ground(point: &Vec3) -> Vec2 {
    Vec2::new(point.x, point.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stairs() -> Soles {
        let step = |i: usize| {
            let x = if i.is_multiple_of(2) { 0.1 } else { -0.1 };
            Vec3::new(x, 0.17 * (i / 2) as f32, 0.35 * i as f32)
        };
        let down: Vec<Vec3> = (0..8).map(step).collect();
        let up = down.windows(2).map(|w| w[0].midpoint(w[1]) + Vec3::Y * 0.2).collect();
        let hips = down.iter().map(|p| *p + Vec3::Y).collect();
        Soles { hips, frames: vec![30.0; down.len()], down, up }
    }

    /// The kernel's scale matters: with one near zero the bend vanishes and feet hang in the air.
    #[test]
    fn the_ground_meets_standing_feet() {
        let (soles, patches) = (stairs(), Patches::from_noise(60, 5));
        let mut random = Random::new(1, "clip");
        for kind in [Kind::Rocky, Kind::Jumpy, Kind::Beam] {
            let grounds = soles.fit(&patches, kind, 5, &mut random);
            assert_eq!(grounds.len(), 5);
            for ground in &grounds {
                for point in &soles.down {
                    let off = (ground.height(point.x, point.z) - point.y).abs();
                    assert!(off <= 0.01, "{kind:?}: a standing foot is {off} m off the ground");
                }
            }
        }
        let flat = soles.fit(&patches, Kind::Flat, 3, &mut random);
        assert!(flat.iter().all(|g| (g.height(1.0, 2.0) - soles.level()).abs() < 1e-6));
    }

    #[test]
    fn the_best_patch_comes_first() {
        let (soles, patches) = (stairs(), Patches::from_noise(60, 5));
        let middle = soles.down.iter().map(ground).sum::<Vec2>() / 8.0;
        let best = soles.fit(&patches, Kind::Rocky, 1, &mut Random::new(1, "")).remove(0);
        let Ground::Fitted { patch, .. } = best else { panic!("fitted") };
        let least = soles.error(patch, middle, Kind::Rocky, &[]);
        for index in 0..patches.len() {
            assert!(soles.error(patches.get(index), middle, Kind::Rocky, &[]) >= least);
        }
    }

    #[test]
    fn published_kinds() {
        assert_eq!(Kind::published("LocomotionFlat12_000"), Some(Kind::Jumpy));
        assert_eq!(Kind::published("LocomotionFlat04_000"), Some(Kind::Flat));
        assert_eq!(Kind::published("WalkingUpSteps10_000"), Some(Kind::Flat));
        assert_eq!(Kind::published("WalkingUpSteps06_000"), Some(Kind::Beam));
        assert_eq!(Kind::published("NewCaptures10_000"), Some(Kind::Rocky));
        assert_eq!(Kind::published("walk1_subject1"), None);
    }

    #[test]
    fn equations_are_solved_or_refused() {
        let mut rows = vec![vec![0.0, 2.0, 4.0], vec![1.0, 1.0, 5.0]];
        assert_eq!(solve(&mut rows), Some(vec![3.0, 2.0]));
        assert_eq!(solve(&mut [vec![1.0, 1.0, 1.0], vec![1.0, 1.0, 2.0]]), None);
    }
}
