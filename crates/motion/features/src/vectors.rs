//! The two vectors as structs, and the way from one to the other.

use ambulo_rig::glam::{Mat3, Quat, Vec2, Vec3};

use crate::layout::{Rates, Rotations};
use crate::{GAITS, Layout, SAMPLES};

/// Samples of the trajectory in the output: frames 0, 10, … 50 after the next one.
pub const FUTURE: usize = SAMPLES / 2;

/// One sample of the trajectory, in the root's frame: x to the left, y of these vectors is z,
/// forward.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Metres.
    pub position: Vec2,
    /// Unit vector along the character's facing.
    pub direction: Vec2,
}

/// What a character stands on at one sample, and how it should move there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ground {
    /// Shares of the gaits, in the order of [`GAITS`], each 0 to 1.
    pub gait: [f32; GAITS.len()],
    /// Heights in metres 25 cm to the left, at the centre, and 25 cm to the right, less the
    /// root's height.
    pub height: [f32; 3],
}

/// What the network is told at frame i, in the frame of root i (the joints in that of root i−1).
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Frames −60, −50, … +50.
    pub trajectory: [Point; SAMPLES],
    /// At the same samples.
    pub ground: [Ground; SAMPLES],
    /// Frame i−1, metres: x and z from root i−1, y from the root's height.
    pub joint_position: Vec<Vec3>,
    /// From frame i−1 to i, metres a second.
    pub joint_velocity: Vec<Vec3>,
}

/// What the network answers at frame i, in the frame of root i (the trajectory in that of root
/// i+1).
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// From root i to root i+1, metres a second, in the frame of root i.
    pub root_velocity: Vec2,
    /// Radians a second, positive from +Z towards +X: to the character's left.
    pub yaw_rate: f32,
    /// Cycles a second.
    pub phase_rate: f32,
    /// Left heel, left toe, right heel, right toe: 1 on the ground.
    pub contacts: [f32; 4],
    /// 0, 10, … 50 frames after frame i+1.
    pub trajectory: [Point; FUTURE],
    /// Metres, y from the root's height.
    pub joint_position: Vec<Vec3>,
    /// Metres a second.
    pub joint_velocity: Vec<Vec3>,
    /// In the root's frame, not the parent's.
    pub joint_rotation: Vec<Quat>,
}

impl Input {
    /// All zero, for a number of joints.
    pub fn zero(joints: usize) -> Self {
        Self {
            trajectory: [Point::default(); SAMPLES],
            ground: [Ground::default(); SAMPLES],
            joint_position: vec![Vec3::ZERO; joints],
            joint_velocity: vec![Vec3::ZERO; joints],
        }
    }
}

impl Output {
    /// At rest, for a number of joints.
    pub fn zero(joints: usize) -> Self {
        Self {
            root_velocity: Vec2::ZERO,
            yaw_rate: 0.0,
            phase_rate: 0.0,
            contacts: [0.0; 4],
            trajectory: [Point::default(); FUTURE],
            joint_position: vec![Vec3::ZERO; joints],
            joint_velocity: vec![Vec3::ZERO; joints],
            joint_rotation: vec![Quat::IDENTITY; joints],
        }
    }
}

impl Layout {
    /// Writes an input as the network takes it.
    ///
    /// # Panics
    /// When joints or `x` have other lengths than the layout.
    pub fn encode_input(&self, input: &Input, x: &mut [f32]) {
        assert_eq!(x.len(), self.input_len(), "length of the input vector");
        assert_eq!(input.joint_position.len(), self.joints(), "joint positions");
        assert_eq!(input.joint_velocity.len(), self.joints(), "joint velocities");
        let (length, speed) = self.scales();
        let mut out = Writer(x);
        out.points(&input.trajectory, length);
        for summed in self.gaits {
            let share = |ground: &Ground| summed.iter().map(|&gait| ground.gait[gait]).sum();
            input.ground.iter().for_each(|ground| out.put(share(ground)));
        }
        out.vectors(&input.joint_position, length);
        out.vectors(&input.joint_velocity, speed);
        for side in 0..3 {
            input.ground.iter().for_each(|g| out.put(g.height[side] * length));
        }
        out.finish();
    }

    /// Reads an input vector into an input that has as many joints; gaits that the layout sums
    /// become the first of them.
    ///
    /// # Panics
    /// When joints or `x` have other lengths than the layout.
    pub fn decode_input(&self, x: &[f32], input: &mut Input) {
        assert_eq!(x.len(), self.input_len(), "length of the input vector");
        let (length, speed) = self.scales();
        let mut numbers = Reader(x);
        numbers.points(&mut input.trajectory, length);
        input.ground.iter_mut().for_each(|g| g.gait = [0.0; GAITS.len()]);
        for summed in self.gaits {
            input.ground.iter_mut().for_each(|g| g.gait[summed[0]] = numbers.take());
        }
        numbers.vectors(&mut input.joint_position, length);
        numbers.vectors(&mut input.joint_velocity, speed);
        for side in 0..3 {
            input.ground.iter_mut().for_each(|g| g.height[side] = numbers.take() / length);
        }
        numbers.finish();
    }

    /// Writes an output as the network is trained to give it.
    ///
    /// # Panics
    /// When joints or `y` have other lengths than the layout.
    pub fn encode_output(&self, output: &Output, y: &mut [f32]) {
        assert_eq!(y.len(), self.output_len(), "length of the output vector");
        let (length, speed) = self.scales();
        let mut out = Writer(y);
        out.put(output.root_velocity.x * speed);
        out.put(output.root_velocity.y * speed);
        let (yaw, phase) = self.turns();
        out.put(output.yaw_rate / yaw);
        out.put(output.phase_rate / phase);
        output.contacts.iter().for_each(|&c| out.put(c));
        out.points(&output.trajectory, length);
        out.vectors(&output.joint_position, length);
        out.vectors(&output.joint_velocity, speed);
        for &rotation in &output.joint_rotation {
            match self.rotations {
                Rotations::HalfLog => {
                    // Of the quaternion with w ≥ 0, as published.
                    let nearer = if rotation.w < 0.0 { -rotation } else { rotation };
                    out.vectors(&[nearer.to_scaled_axis()], 0.5);
                }
                Rotations::TwoAxes => out.vectors(&[rotation * Vec3::X, rotation * Vec3::Y], 1.0),
            }
        }
        out.finish();
    }

    /// Reads an output vector into an output that has as many joints. Allocates nothing.
    ///
    /// # Panics
    /// When joints or `y` have other lengths than the layout.
    pub fn decode_output(&self, y: &[f32], output: &mut Output) {
        assert_eq!(y.len(), self.output_len(), "length of the output vector");
        let (length, speed) = self.scales();
        let mut numbers = Reader(y);
        output.root_velocity.x = numbers.take() / speed;
        output.root_velocity.y = numbers.take() / speed;
        let (yaw, phase) = self.turns();
        output.yaw_rate = numbers.take() * yaw;
        output.phase_rate = numbers.take() * phase;
        output.contacts.iter_mut().for_each(|c| *c = numbers.take());
        numbers.points(&mut output.trajectory, length);
        numbers.vectors(&mut output.joint_position, length);
        numbers.vectors(&mut output.joint_velocity, speed);
        for rotation in &mut output.joint_rotation {
            let mut axes = [Vec3::ZERO; 2];
            *rotation = match self.rotations {
                Rotations::HalfLog => {
                    numbers.vectors(&mut axes[..1], 0.5);
                    Quat::from_scaled_axis(axes[0])
                }
                Rotations::TwoAxes => {
                    numbers.vectors(&mut axes, 1.0);
                    from_two_axes(axes)
                }
            };
        }
        numbers.finish();
    }

    /// Factors from metres, and from metres a second, to the layout's units.
    fn scales(&self) -> (f32, f32) {
        let length = self.units_per_metre();
        match self.rates {
            Rates::Second => (length, length),
            Rates::Frame => (length, length / self.fps()),
        }
    }

    /// Factors to radians a second to the left, and to cycles a second.
    fn turns(&self) -> (f32, f32) {
        match self.rates {
            Rates::Second => (1.0, 1.0),
            Rates::Frame => (-self.fps(), self.fps()),
        }
    }
}

/// The rotation whose X axis goes along the first vector, and whose Y axis lies in the plane of
/// both; any vectors give a rotation.
fn from_two_axes([x, y]: [Vec3; 2]) -> Quat {
    let x = x.normalize_or(Vec3::X);
    let z = x.cross(y).normalize_or(x.any_orthonormal_vector());
    Quat::from_mat3(&Mat3::from_cols(x, z.cross(x), z))
}

/// Fills a vector from the front.
struct Writer<'a>(&'a mut [f32]);

impl Writer<'_> {
    fn put(&mut self, number: f32) {
        let (first, rest) = std::mem::take(&mut self.0).split_first_mut().expect("room for it");
        *first = number;
        self.0 = rest;
    }

    fn points(&mut self, points: &[Point], scale: f32) {
        points.iter().for_each(|p| self.put(p.position.x * scale));
        points.iter().for_each(|p| self.put(p.position.y * scale));
        points.iter().for_each(|p| self.put(p.direction.x));
        points.iter().for_each(|p| self.put(p.direction.y));
    }

    fn vectors(&mut self, vectors: &[Vec3], scale: f32) {
        vectors.iter().flat_map(|v| v.to_array()).for_each(|number| self.put(number * scale));
    }

    fn finish(self) {
        assert!(self.0.is_empty(), "the blocks end before the vector");
    }
}

/// Reads a vector from the front.
struct Reader<'a>(&'a [f32]);

impl Reader<'_> {
    fn take(&mut self) -> f32 {
        let (first, rest) = self.0.split_first().expect("a number left");
        self.0 = rest;
        *first
    }

    fn points(&mut self, points: &mut [Point], scale: f32) {
        points.iter_mut().for_each(|p| p.position.x = self.take() / scale);
        points.iter_mut().for_each(|p| p.position.y = self.take() / scale);
        points.iter_mut().for_each(|p| p.direction.x = self.take());
        points.iter_mut().for_each(|p| p.direction.y = self.take());
    }

    fn vectors(&mut self, vectors: &mut [Vec3], scale: f32) {
        for vector in vectors {
            *vector = Vec3::new(self.take(), self.take(), self.take()) / scale;
        }
    }

    fn finish(self) {
        assert!(self.0.is_empty(), "the blocks end before the vector");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const JOINTS: usize = 3;

    fn at(blocks: &[crate::Block], name: &str) -> usize {
        Layout::range(blocks, name).start
    }

    /// Every number lies where the published layout has it, in its unit.
    #[test]
    fn input_numbers_lie_where_they_should() {
        let layout = Layout::holden(JOINTS).unwrap();
        let mut input = Input::zero(JOINTS);
        input.trajectory[7].position = Vec2::new(0.25, 0.5);
        input.trajectory[2].direction = Vec2::new(0.6, 0.8);
        input.ground[4].gait = [0.1, 0.2, 0.1, 0.2, 0.4, 0.5, 0.6];
        input.ground[11].height = [0.01, 0.02, 0.03];
        input.joint_position[1] = Vec3::new(0.1, 0.9, -0.2);
        input.joint_velocity[2] = Vec3::new(0.6, 1.2, -1.8);
        let mut x = vec![0.0; layout.input_len()];
        layout.encode_input(&input, &mut x);
        let near = |name: &str, index: usize, expected: f32| {
            let got = x[at(layout.inputs(), name) + index];
            assert!((got - expected).abs() < 1e-5, "{name}[{index}] is {got}, not {expected}");
        };
        near("trajectory_x", 7, 25.0);
        near("trajectory_z", 7, 50.0);
        near("direction_x", 2, 0.6);
        near("direction_z", 2, 0.8);
        let gaits =
            ["gait_stand", "gait_walk", "gait_jog", "gait_crouch", "gait_jump", "gait_bump"];
        gaits.iter().enumerate().for_each(|(i, gait)| near(gait, 4, (i + 1) as f32 * 0.1));
        near("terrain_left", 11, 1.0);
        near("terrain_centre", 11, 2.0);
        near("terrain_right", 11, 3.0);
        (0..3).for_each(|i| near("joint_position", 3 + i, [10.0, 90.0, -20.0][i]));
        (0..3).for_each(|i| near("joint_velocity", 6 + i, [1.0, 2.0, -3.0][i]));
    }

    #[test]
    fn output_numbers_lie_where_they_should() {
        let layout = Layout::holden(JOINTS).unwrap();
        let mut y = vec![0.0; layout.output_len()];
        let mut set = |name: &str, values: &[f32]| {
            y[at(layout.outputs(), name)..][..values.len()].copy_from_slice(values);
        };
        set("root_velocity", &[1.0, 2.5]);
        set("root_yaw", &[0.01]);
        set("phase_rate", &[0.0167]);
        set("contacts", &[0.1, 0.2, 0.3, 0.4]);
        set("trajectory_z", &[0.0, 10.0]);
        set("joint_velocity", &[0.0, 1.0, 0.0]);
        // A quarter turn about X: half the angle is π/4.
        set("joint_rotation", &[0.0, 0.0, 0.0, std::f32::consts::FRAC_PI_4, 0.0, 0.0]);
        let mut output = Output::zero(JOINTS);
        layout.decode_output(&y, &mut output);
        assert!(output.root_velocity.abs_diff_eq(Vec2::new(0.6, 1.5), 1e-6));
        assert!((output.yaw_rate + 0.6).abs() < 1e-6, "the sign is that of the character");
        assert!((output.phase_rate - 1.002).abs() < 1e-5);
        assert_eq!(output.contacts, [0.1, 0.2, 0.3, 0.4]);
        assert!((output.trajectory[1].position.y - 0.1).abs() < 1e-6);
        assert!((output.joint_velocity[0].y - 0.6).abs() < 1e-6);
        let turned = output.joint_rotation[1] * Vec3::Y;
        assert!(turned.abs_diff_eq(Vec3::Z, 1e-6), "{turned}");
    }

    /// Ambulo's own layout is metres and seconds throughout, and left is positive.
    #[test]
    fn ambulo_numbers_are_si() {
        let layout = Layout::ambulo(1).unwrap();
        let mut output = Output::zero(1);
        output.root_velocity = Vec2::new(0.1, 1.5);
        output.yaw_rate = 0.6;
        output.phase_rate = 1.1;
        output.joint_velocity[0] = Vec3::new(0.0, 2.0, 0.0);
        output.joint_rotation[0] = Quat::from_rotation_x(2.5);
        let mut y = vec![0.0; layout.output_len()];
        layout.encode_output(&output, &mut y);
        assert_eq!(y[..4], [0.1, 1.5, 0.6, 1.1]);
        assert_eq!(y[Layout::range(layout.outputs(), "joint_velocity")], [0.0, 2.0, 0.0]);
        let mut again = Output::zero(1);
        layout.decode_output(&y, &mut again);
        assert!(again.joint_rotation[0].angle_between(output.joint_rotation[0]) < 1e-3);
        let mut input = Input::zero(1);
        input.ground[3].gait = [0.0, 0.0, 0.25, 0.75, 0.0, 0.0, 0.0];
        let mut x = vec![0.0; layout.input_len()];
        layout.encode_input(&input, &mut x);
        assert_eq!(x[at(layout.inputs(), "gait_run") + 3], 0.75);
        let mut again = Input::zero(1);
        layout.decode_input(&x, &mut again);
        assert_eq!(again, input);
    }

    /// A network's two axes are neither unit nor at right angles, and may be anything.
    #[test]
    fn any_two_axes_are_a_rotation() {
        let near = from_two_axes([Vec3::new(2.0, 0.1, 0.0), Vec3::new(0.3, 1.0, 0.0)]);
        assert!(near.angle_between(Quat::from_rotation_z(0.05)) < 0.01);
        for axes in [[Vec3::ZERO; 2], [Vec3::X; 2], [Vec3::Y, Vec3::NEG_Y], [Vec3::NEG_X; 2]] {
            assert!(from_two_axes(axes).is_normalized(), "{axes:?}");
        }
    }

    proptest! {
        #[test]
        fn inputs_survive(x in prop::collection::vec(-100.0f32..100.0, 120 + 6 * JOINTS + 36)) {
            let layout = Layout::holden(JOINTS).unwrap();
            let mut input = Input::zero(JOINTS);
            layout.decode_input(&x, &mut input);
            let mut again = vec![0.0; x.len()];
            layout.encode_input(&input, &mut again);
            for (a, b) in x.iter().zip(&again) {
                prop_assert!((a - b).abs() <= 1e-5 * a.abs().max(1e-3));
            }
        }

        /// Rotations below a half turn have one logarithm; all else is linear.
        #[test]
        fn outputs_survive(y in prop::collection::vec(-0.85f32..0.85, 32 + 9 * JOINTS)) {
            let layout = Layout::holden(JOINTS).unwrap();
            let mut output = Output::zero(JOINTS);
            layout.decode_output(&y, &mut output);
            let mut again = vec![0.0; y.len()];
            layout.encode_output(&output, &mut again);
            for (a, b) in y.iter().zip(&again) {
                prop_assert!((a - b).abs() <= 1e-4, "{a} {b}");
            }
        }
    }
}
