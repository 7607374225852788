//! The joints that labels and features need, by role.

use std::iter::Sum;
use std::ops::Sub;

use ambulo_rig::{Roles, Skeleton};
use serde::{Deserialize, Serialize};

/// Names of joints by role, as a person edits them; pairs are left, right.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoleNames {
    /// The joint that carries legs and spine; it becomes the root.
    pub hips: String,
    /// Where the upper legs hang.
    pub thighs: Vec<String>,
    /// Ankles.
    pub feet: Vec<String>,
    /// Balls of the feet; the ankles again for a skeleton without.
    pub toes: Vec<String>,
    /// Where the upper arms hang; empty for a body without arms.
    pub arms: Vec<String>,
    /// Empty for a body without a head.
    pub head: String,
}

impl RoleNames {
    /// Names of what was found.
    ///
    /// # Errors
    /// The role that is missing, in words that say what to do.
    pub fn of(roles: &Roles, skeleton: &Skeleton) -> Result<Self, String> {
        let name = |joint: usize| skeleton.joints()[joint].name.clone();
        let pair = |pair: [usize; 2]| pair.map(name).to_vec();
        let needed = |role: &str, found: Option<[usize; 2]>| {
            found.map(pair).ok_or_else(|| {
                format!(
                    "no {role} found by name or shape: name them under [roles] in a --config file"
                )
            })
        };
        let hips = roles.hips.map(name);
        let hips = hips.ok_or("no hips found by name or shape: name them under [roles]")?;
        let feet = needed("feet", roles.feet)?;
        Ok(Self {
            hips,
            thighs: needed("thighs", roles.thighs)?,
            toes: roles.toes.map_or_else(|| feet.clone(), pair),
            feet,
            arms: roles.arms.map_or(vec![], pair),
            head: roles.head.map(name).unwrap_or_default(),
        })
    }

    /// The roles that are named here, of any skeleton.
    pub fn found_in(&self, skeleton: &Skeleton) -> Roles {
        let pair = |names: &[String]| match names {
            [left, right] => Some([skeleton.find(left)?, skeleton.find(right)?]),
            _ => None,
        };
        Roles {
            hips: skeleton.find(&self.hips),
            head: skeleton.find(&self.head),
            thighs: pair(&self.thighs),
            feet: pair(&self.feet),
            toes: pair(&self.toes),
            arms: pair(&self.arms),
            hands: None,
        }
    }
}

/// The same as joint indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body {
    /// The joint that carries legs and spine.
    pub hips: usize,
    /// Left, right.
    pub thighs: [usize; 2],
    /// Ankles, left, right.
    pub feet: [usize; 2],
    /// Balls of the feet, left, right.
    pub toes: [usize; 2],
    /// Upper arms, left, right.
    pub arms: Option<[usize; 2]>,
    /// The head.
    pub head: Option<usize>,
}

impl Body {
    /// Finds the named joints.
    ///
    /// # Errors
    /// A name that is missing, or a pair that does not name two joints.
    pub fn new(names: &RoleNames, skeleton: &Skeleton) -> Result<Self, String> {
        let joint = |role: &str, name: &str| {
            skeleton.find(name).ok_or_else(|| format!("it has no joint '{name}' (roles.{role})"))
        };
        let pair = |role: &str, names: &[String]| match names {
            [left, right] if left != right => Ok([joint(role, left)?, joint(role, right)?]),
            _ => Err(format!("roles.{role} must name two joints: [left, right]")),
        };
        Ok(Self {
            hips: joint("hips", &names.hips)?,
            thighs: pair("thighs", &names.thighs)?,
            feet: pair("feet", &names.feet)?,
            toes: pair("toes", &names.toes)?,
            arms: if names.arms.is_empty() { None } else { Some(pair("arms", &names.arms)?) },
            head: if names.head.is_empty() { None } else { Some(joint("head", &names.head)?) },
        })
    }

    /// From right to left over thighs and upper arms, for places of joints.
    pub fn across<V: Sum + Sub<Output = V>>(&self, place: impl Fn(usize) -> V) -> V {
        let pairs = [Some(self.thighs), self.arms].into_iter().flatten();
        pairs.map(|[left, right]| place(left) - place(right)).sum()
    }

    /// Left heel, left toe, right heel, right toe: the order of the contacts.
    pub fn soles(&self) -> [usize; 4] {
        [self.feet[0], self.toes[0], self.feet[1], self.toes[1]]
    }
}
