//! Bodies that evolve: parts larger, stronger or denser than the creature's file has them.
//!
//! As in Sims, "Evolving Virtual Creatures" (1994) the body is found together with its controller; as
//! in Ha, "Reinforcement Learning for Improving Agent Design" (2019) the drawing stays what it is and
//! only its measures change, within bounds.

use serde::{Deserialize, Serialize};

use crate::{Body, BodyError};

/// The least and the greatest factor that a bound may be.
const FURTHEST: [f32; 2] = [0.25, 4.0];

/// The bounds of what evolves, as factors of what the creature's file says: the first at least 0.25
/// and at most 1, the second 1 to 4. `[1, 1]` stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct Morphology {
    /// Of a part's size, about the joint that it hangs on; what hangs on the part moves along.
    pub size: [f32; 2],
    /// Of the torque of the motor that moves a part.
    pub strength: [f32; 2],
    /// Of a part's density.
    pub density: [f32; 2],
}

impl Default for Morphology {
    fn default() -> Self {
        Self { size: [0.8, 1.25], strength: [0.8, 1.25], density: [0.8, 1.25] }
    }
}

/// Bounds that cannot be.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum MorphologyError {
    #[error("{field}: [{}, {}] is not a factor of 0.25 to 1 and one of 1 to 4", .bounds[0], .bounds[1])]
    Bounds { field: &'static str, bounds: [f32; 2] },
    #[error("the creature cannot be {which}: {source}")]
    Extreme { which: &'static str, source: BodyError },
}

/// What of a part changes.
#[derive(Clone, Copy)]
enum Measure {
    Size,
    Strength,
    Density,
}

impl Morphology {
    /// How many numbers a genome has for a body: for the torso and every part, or pair of parts that
    /// hang on paired joints, one for each of what evolves.
    pub fn genes(&self, body: &Body) -> usize {
        self.genes_of(body).0
    }

    /// # Errors
    /// Bounds out of range; bounds at which the creature would not be one.
    pub fn check(&self, body: &Body) -> Result<(), MorphologyError> {
        let [least, most] = FURTHEST;
        for (field, bounds) in
            [("size", self.size), ("strength", self.strength), ("density", self.density)]
        {
            if !((least..=1.0).contains(&bounds[0]) && (1.0..=most).contains(&bounds[1])) {
                return Err(MorphologyError::Bounds { field, bounds });
            }
        }
        let genes = self.genes(body);
        for (which, gene) in [("so small or weak", -1e3), ("so large or strong", 1e3)] {
            let extreme = self.apply(body, &vec![gene; genes]);
            extreme.map_err(|source| MorphologyError::Extreme { which, source })?;
        }
        Ok(())
    }

    /// The body that a genome means. A gene of 0 leaves what it is for as the file has it; lesser and
    /// greater ones come near the bounds as their tanh does.
    ///
    /// # Errors
    /// None after [`Morphology::check`].
    ///
    /// # Panics
    /// Another number of genes.
    pub fn apply(&self, body: &Body, genes: &[f32]) -> Result<Body, BodyError> {
        let (count, places) = self.genes_of(body);
        assert_eq!(genes.len(), count, "a genome of this body");
        let factor = |part: usize, measure: Measure, [least, most]: [f32; 2]| {
            let Some(place) = places[part][measure as usize] else { return 1.0 };
            let share = libm::tanhf(genes[place]);
            libm::powf(if share < 0.0 { least } else { most }, share.abs())
        };
        let mut description = body.description().clone();
        // Where each part's points come from and go to, and its factor of size.
        let mut moved = vec![([0.0; 2], [0.0; 2], 1.0); description.parts.len()];
        let onto = |([fx, fy], [tx, ty], size): ([f32; 2], [f32; 2], f32), [x, y]: [f32; 2]| {
            // What neither moves nor grows keeps its place to the last bit.
            [x + (tx - fx) + (size - 1.0) * (x - fx), y + (ty - fy) + (size - 1.0) * (y - fy)]
        };
        for part in downwards(body) {
            let size = factor(part, Measure::Size, self.size);
            moved[part] = match body.above(part) {
                None => (body.parts()[part].position, body.parts()[part].position, size),
                Some((parent, joint)) => {
                    let from = body.joints()[joint].anchor;
                    let to = onto(moved[parent], from);
                    let joint = &mut description.joints[joint];
                    joint.anchor = to;
                    joint.torque *= factor(part, Measure::Strength, self.strength);
                    (from, to, size)
                }
            };
            let changed = &mut description.parts[part];
            changed.position = onto(moved[part], changed.position);
            changed.shape = changed.shape.scaled(size);
            changed.density *= factor(part, Measure::Density, self.density);
        }
        Body::new(description)
    }

    /// How many genes there are, and for each part where its own are: size, strength, density.
    fn genes_of(&self, body: &Body) -> (usize, Vec<[Option<usize>; 3]>) {
        let mut places = vec![[None; 3]; body.parts().len()];
        let mut count = 0;
        let twin = twins(body);
        for part in 0..places.len() {
            if let Some(first) = twin[part].filter(|&first| first < part) {
                places[part] = places[first];
                continue;
            }
            let driven = body.above(part).is_some_and(|(_, joint)| body.driven().contains(&joint));
            let evolves = [
                self.size != [1.0; 2],
                self.strength != [1.0; 2] && driven,
                self.density != [1.0; 2],
            ];
            for (place, _) in places[part].iter_mut().zip(evolves).filter(|(_, evolves)| *evolves) {
                *place = Some(count);
                count += 1;
            }
        }
        (count, places)
    }
}

/// Parts from the torso outwards.
fn downwards(body: &Body) -> Vec<usize> {
    let mut order = vec![body.torso()];
    let mut next = 0;
    while next < order.len() {
        let hangs = |part: &usize| body.above(*part).is_some_and(|(on, _)| on == order[next]);
        let below: Vec<_> = (0..body.parts().len()).filter(hangs).collect();
        order.extend(below);
        next += 1;
    }
    order
}

/// For each part the one that hangs on the other joint of a pair.
fn twins(body: &Body) -> Vec<Option<usize>> {
    let mut twins = vec![None; body.parts().len()];
    for pair in body.pairs() {
        let [a, b] = pair.map(|joint| body.ends(body.driven()[joint]).1);
        (twins[a], twins[b]) = (Some(b), Some(a));
    }
    twins
}
