//! What a level tells a character: ground, walls, where to jump and where to duck.

use ambulo_rig::Terrain;
use ambulo_rig::glam::{Vec2, Vec3};

/// A wall on the ground plane (x, z) that the trajectory keeps its distance from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// One end, metres.
    pub start: Vec2,
    /// The other end.
    pub end: Vec2,
    /// Distance to keep, metres; 0.2 in the published demo.
    pub width: f32,
}

impl Wall {
    /// The point moved out to the wall's distance, if it is nearer.
    pub fn push_out(&self, point: Vec2) -> Vec2 {
        let along = self.end - self.start;
        let t = (point - self.start).dot(along) / along.length_squared().max(1e-12);
        let nearest = self.start + along * t.clamp(0.0, 1.0);
        let away = point - nearest;
        if away.length_squared() >= self.width * self.width {
            return point;
        }
        // On the wall itself either side is as good.
        let side = along.perp().normalize_or(Vec2::X);
        nearest + away.normalize_or(side) * self.width
    }
}

/// A place to jump over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpArea {
    /// Centre, metres.
    pub centre: Vec3,
    /// Full jump within this distance; 0.75 in the published demo.
    pub radius: f32,
    /// No jump beyond radius + falloff; 1.0 in the published demo.
    pub falloff: f32,
}

impl JumpArea {
    /// 1 inside, 0 far off.
    pub fn amount(&self, point: Vec3) -> f32 {
        let beyond = point.distance(self.centre) - self.radius;
        1.0 - (beyond / self.falloff.max(1e-6)).clamp(0.0, 1.0)
    }
}

/// A low place to crouch through: a box on the ground plane, parallel to the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrouchArea {
    /// Centre (x, z), metres.
    pub centre: Vec2,
    /// Half the extent in x and z.
    pub half_size: Vec2,
    /// How much to crouch inside, 0 to 1.
    pub amount: f32,
    /// Distance over which it fades outside; 1.0 in the published demo.
    pub falloff: f32,
}

impl CrouchArea {
    /// `amount` inside, fading to 0 outside.
    pub fn amount(&self, point: Vec2) -> f32 {
        let outside = ((point - self.centre).abs() - self.half_size).max(Vec2::ZERO).length();
        self.amount * (1.0 - (outside / self.falloff.max(1e-6)).clamp(0.0, 1.0))
    }
}

/// Walls and areas of a level.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Areas {
    pub walls: Vec<Wall>,
    pub jumps: Vec<JumpArea>,
    pub crouches: Vec<CrouchArea>,
}

impl Areas {
    /// The point pushed out of every wall near it.
    pub fn keep_out(&self, point: Vec2) -> Vec2 {
        self.walls.iter().fold(point, |point, wall| wall.push_out(point))
    }

    /// The strongest jump at a point.
    pub fn jump(&self, point: Vec3) -> f32 {
        self.jumps.iter().map(|area| area.amount(point)).fold(0.0, f32::max)
    }

    /// The strongest crouch at a point.
    pub fn crouch(&self, point: Vec2) -> f32 {
        self.crouches.iter().map(|area| area.amount(point)).fold(0.0, f32::max)
    }
}

/// What the game answers during a step.
#[derive(Clone, Copy)]
pub struct World<'a> {
    /// The ground.
    pub terrain: &'a dyn Terrain,
    /// Walls and areas.
    pub areas: &'a Areas,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_push_out_to_their_width_and_no_further() {
        let wall = Wall { start: Vec2::ZERO, end: Vec2::new(4.0, 0.0), width: 0.2 };
        assert!(wall.push_out(Vec2::new(1.0, 0.05)).abs_diff_eq(Vec2::new(1.0, 0.2), 1e-6));
        assert!(wall.push_out(Vec2::new(1.0, -0.05)).abs_diff_eq(Vec2::new(1.0, -0.2), 1e-6));
        assert_eq!(wall.push_out(Vec2::new(1.0, 0.3)), Vec2::new(1.0, 0.3));
        assert!(wall.push_out(Vec2::new(4.1, 0.0)).abs_diff_eq(Vec2::new(4.2, 0.0), 1e-6));
        let on_it = wall.push_out(Vec2::new(2.0, 0.0));
        assert!((on_it.y.abs() - 0.2).abs() < 1e-6);
        let point = Wall { start: Vec2::ONE, end: Vec2::ONE, width: 0.5 };
        assert!((point.push_out(Vec2::ONE).distance(Vec2::ONE) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn areas_fade() {
        let jump = JumpArea { centre: Vec3::ZERO, radius: 0.75, falloff: 1.0 };
        assert_eq!(jump.amount(Vec3::new(0.5, 0.0, 0.0)), 1.0);
        assert!((jump.amount(Vec3::new(1.25, 0.0, 0.0)) - 0.5).abs() < 1e-6);
        assert_eq!(jump.amount(Vec3::new(3.0, 0.0, 0.0)), 0.0);
        let low = CrouchArea {
            centre: Vec2::new(1.0, 0.0),
            half_size: Vec2::new(1.0, 2.0),
            amount: 0.8,
            falloff: 1.0,
        };
        assert_eq!(low.amount(Vec2::new(1.5, 1.0)), 0.8);
        assert!((low.amount(Vec2::new(2.5, 0.0)) - 0.4).abs() < 1e-6);
        assert_eq!(low.amount(Vec2::new(-2.0, 0.0)), 0.0);
    }
}
