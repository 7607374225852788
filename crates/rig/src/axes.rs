//! Which way is up, and how long a unit is: coordinate systems as values.

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A signed coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub enum Axis {
    #[serde(rename = "+x")]
    PosX,
    #[serde(rename = "-x")]
    NegX,
    #[serde(rename = "+y")]
    PosY,
    #[serde(rename = "-y")]
    NegY,
    #[serde(rename = "+z")]
    PosZ,
    #[serde(rename = "-z")]
    NegZ,
}

impl Axis {
    /// All six, in the order x, y, z, the positive one first.
    pub const ALL: [Self; 6] =
        [Self::PosX, Self::NegX, Self::PosY, Self::NegY, Self::PosZ, Self::NegZ];

    /// The unit vector along this axis.
    pub fn vector(self) -> DVec3 {
        match self {
            Self::PosX => DVec3::X,
            Self::NegX => DVec3::NEG_X,
            Self::PosY => DVec3::Y,
            Self::NegY => DVec3::NEG_Y,
            Self::PosZ => DVec3::Z,
            Self::NegZ => DVec3::NEG_Z,
        }
    }

    /// The axis that is nearest to a direction.
    pub fn nearest(direction: DVec3) -> Self {
        let along = |axis: &Self| axis.vector().dot(direction);
        let better = |a: Self, b: Self| if along(&b) > along(&a) { b } else { a };
        Self::ALL.into_iter().reduce(better).unwrap_or(Self::PosY)
    }
}

impl std::fmt::Display for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::PosX => "+X",
            Self::NegX => "-X",
            Self::PosY => "+Y",
            Self::NegY => "-Y",
            Self::PosZ => "+Z",
            Self::NegZ => "-Z",
        })
    }
}

/// Whether X × Y points along +Z as a right or as a left hand shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Handedness {
    Right,
    Left,
}

/// A coordinate system: up, the way a character faces, handedness and unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axes {
    /// Against gravity.
    pub up: Axis,
    /// The way a character faces when its root is not turned; perpendicular to `up`.
    pub forward: Axis,
    /// Of the coordinate system.
    pub handedness: Handedness,
    /// Length of one unit in metres, > 0.
    pub metres_per_unit: f64,
}

/// Why axes cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum AxesError {
    #[error("up ({0}) and forward ({1}) must be perpendicular")]
    Parallel(Axis, Axis),
    #[error("metres per unit must be positive and finite, not {0}")]
    Unit(f64),
    #[error("unknown axes '{0}'; known: {known}", known = Axes::PRESETS.map(|(name, _)| name).join(", "))]
    Unknown(String),
}

const fn axes(up: Axis, forward: Axis, handedness: Handedness, metres_per_unit: f64) -> Axes {
    Axes { up, forward, handedness, metres_per_unit }
}

impl Axes {
    /// Ambulo's own: right-handed, +Y up, +Z forward, metres (as glTF).
    pub const CANONICAL: Self = axes(Axis::PosY, Axis::PosZ, Handedness::Right, 1.0);

    /// Systems by name: engines, exchange formats and the units BVH files come in.
    pub const PRESETS: [(&'static str, Self); 13] = {
        use Axis::{NegY, NegZ, PosX, PosY, PosZ};
        use Handedness::{Left, Right};
        [
            ("ambulo", Self::CANONICAL),
            ("gltf", axes(PosY, PosZ, Right, 1.0)),
            ("vrm", axes(PosY, PosZ, Right, 1.0)),
            ("three", axes(PosY, PosZ, Right, 1.0)),
            ("godot", axes(PosY, NegZ, Right, 1.0)),
            ("blender", axes(PosZ, NegY, Right, 1.0)),
            ("unity", axes(PosY, PosZ, Left, 1.0)),
            ("unreal", axes(PosZ, PosX, Left, 0.01)),
            ("babylon", axes(PosY, PosZ, Left, 1.0)),
            ("cm", axes(PosY, PosZ, Right, 0.01)),
            ("inch", axes(PosY, PosZ, Right, 0.0254)),
            // CMU's ASF files and their BVH conversions: 1 / 0.45 inches.
            ("cmu", axes(PosY, PosZ, Right, 0.0254 / 0.45)),
            ("z-up-cm", axes(PosZ, NegY, Right, 0.01)),
        ]
    };

    /// The preset of that name, in any case.
    ///
    /// # Errors
    /// An unknown name; the message lists the known ones.
    pub fn named(name: &str) -> Result<Self, AxesError> {
        let found = Self::PRESETS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
        found.map(|(_, axes)| *axes).ok_or_else(|| AxesError::Unknown(name.into()))
    }

    /// Unit vector towards an unturned character's left.
    pub fn left(self) -> DVec3 {
        let left = self.up.vector().cross(self.forward.vector());
        match self.handedness {
            Handedness::Right => left,
            Handedness::Left => -left,
        }
    }

    /// The same axes with another unit.
    pub fn with_unit(self, metres_per_unit: f64) -> Self {
        Self { metres_per_unit, ..self }
    }

    /// How points and rotations in these axes are written in `target`.
    ///
    /// # Errors
    /// Axes whose up and forward are not perpendicular, a unit that is not positive.
    pub fn to(self, target: Self) -> Result<Conversion, AxesError> {
        for axes in [self, target] {
            if axes.up.vector().dot(axes.forward.vector()) != 0.0 {
                return Err(AxesError::Parallel(axes.up, axes.forward));
            }
            if !(axes.metres_per_unit > 0.0 && axes.metres_per_unit.is_finite()) {
                return Err(AxesError::Unit(axes.metres_per_unit));
            }
        }
        let basis =
            |axes: Self| DMat3::from_cols(axes.left(), axes.up.vector(), axes.forward.vector());
        let matrix = basis(target) * basis(self).transpose();
        Ok(Conversion {
            matrix,
            reflects: matrix.determinant() < 0.0,
            scale: self.metres_per_unit / target.metres_per_unit,
        })
    }
}

/// A change of axes and unit, made by [`Axes::to`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conversion {
    matrix: DMat3,
    reflects: bool,
    scale: f64,
}

impl Conversion {
    /// A point or an offset.
    pub fn point(&self, point: DVec3) -> DVec3 {
        self.matrix * point * self.scale
    }

    /// A direction: turned, not scaled.
    pub fn direction(&self, direction: DVec3) -> DVec3 {
        self.matrix * direction
    }

    /// A rotation, by change of basis: the axis is a pseudovector, so a reflection also turns
    /// the sense of rotation around.
    pub fn rotation(&self, rotation: DQuat) -> DQuat {
        let axis = self.matrix * DVec3::new(rotation.x, rotation.y, rotation.z);
        let axis = if self.reflects { -axis } else { axis };
        DQuat::from_xyzw(axis.x, axis.y, axis.z, rotation.w)
    }

    /// Factor on lengths.
    pub fn scale(&self) -> f64 {
        self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Clip, Joint, Skeleton, Transform};
    use proptest::prelude::*;

    /// A figure whose left hand hangs to its left and is raised by its clip.
    fn left_hand_raised() -> Clip {
        let joint =
            |name: &str, parent, offset| Joint { name: name.into(), parent, offset, tips: vec![] };
        let skeleton = Skeleton::new(vec![
            joint("Hips", None, DVec3::ZERO),
            joint("LeftArm", Some(0), DVec3::new(0.2, 0.5, 0.0)),
            joint("LeftHand", Some(1), DVec3::new(0.6, 0.0, 0.0)),
            joint("RightArm", Some(0), DVec3::new(-0.2, 0.5, 0.0)),
            joint("RightHand", Some(3), DVec3::new(-0.6, 0.0, 0.0)),
        ])
        .unwrap();
        let mut rotations = vec![DQuat::IDENTITY; 5];
        // About +Z, from +X (left) to +Y (up), and a little forward.
        rotations[1] = DQuat::from_rotation_y(-0.3) * DQuat::from_rotation_z(1.4);
        Clip::new(skeleton, 1.0, vec![0], vec![DVec3::new(0.0, 1.0, 0.0)], rotations).unwrap()
    }

    #[test]
    fn the_left_hand_stays_the_left_hand_in_every_host() {
        let clip = left_hand_raised();
        for (name, axes) in Axes::PRESETS {
            let converted = clip.converted(&Axes::CANONICAL.to(axes).unwrap());
            let mut pose = converted.skeleton().rest_pose();
            converted.frame(0, &mut pose);
            let mut global = vec![Transform::IDENTITY; 5];
            pose.to_global(converted.skeleton(), &mut global);
            let metres = |joint: usize| global[joint].translation.as_dvec3() * axes.metres_per_unit;
            let hand = metres(2) - metres(1);
            assert!((hand.length() - 0.6).abs() < 1e-5, "{name}: length {}", hand.length());
            assert!(hand.dot(axes.up.vector()) > 0.55, "{name}: the left hand is raised");
            assert!(hand.dot(axes.forward.vector()) > 0.01, "{name}: a little forward");
            assert!(metres(1).dot(axes.left()) > 0.19, "{name}: the left arm is on the left");
            let down = metres(4) - metres(3);
            assert!(down.dot(axes.left()) < -0.59, "{name}: the right hand is not raised");
        }
    }

    #[test]
    fn published_hosts_put_left_where_they_say() {
        let left = |name| Axes::named(name).unwrap().left();
        assert_eq!(left("gltf"), DVec3::X);
        assert_eq!(left("godot"), DVec3::NEG_X);
        assert_eq!(left("blender"), DVec3::X);
        assert_eq!(left("Unity"), DVec3::NEG_X);
        assert_eq!(left("unreal"), DVec3::NEG_Y);
        assert!(Axes::named("quake").unwrap_err().to_string().contains("unreal"));
    }

    #[test]
    fn refuses_axes_that_are_none() {
        let flat = Axes { forward: Axis::NegY, ..Axes::CANONICAL };
        assert!(matches!(flat.to(Axes::CANONICAL), Err(AxesError::Parallel(..))));
        assert!(matches!(
            Axes::CANONICAL.to(Axes::CANONICAL.with_unit(0.0)),
            Err(AxesError::Unit(_))
        ));
    }

    proptest! {
        /// Converting a rotated point equals rotating the converted point, through any systems.
        #[test]
        fn rotations_and_points_agree(
            from in 0..Axes::PRESETS.len(), to in 0..Axes::PRESETS.len(),
            q in prop::array::uniform4(-1.0..1.0f64), p in prop::array::uniform3(-5.0..5.0f64),
        ) {
            let rotation = DQuat::from_array(q);
            prop_assume!(rotation.length() > 0.1);
            let (rotation, point) = (rotation.normalize(), DVec3::from_array(p));
            let conversion = Axes::PRESETS[from].1.to(Axes::PRESETS[to].1).unwrap();
            let a = conversion.point(rotation * point);
            let b = conversion.rotation(rotation) * conversion.point(point);
            prop_assert!(a.abs_diff_eq(b, 1e-9 * (1.0 + a.length())));
            let back = Axes::PRESETS[to].1.to(Axes::PRESETS[from].1).unwrap();
            prop_assert!(back.rotation(conversion.rotation(rotation)).abs_diff_eq(rotation, 1e-12));
        }
    }
}
