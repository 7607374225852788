//! What a creature file must be; each refusal names the place in the document.

use std::collections::{HashMap, HashSet};
use std::fmt;

use crate::description::{Description, FORMAT_VERSION, Joint, Part, Sensor, Shape, Tag};

/// The most parts that a creature may have.
pub const MOST_PARTS: usize = 64;
/// Bytes of the longest file that is read.
const MOST_BYTES: usize = 1 << 20;
/// Metres: the shortest side of a box or polygon, and the least width of a polygon. Box2D welds
/// corners that are within 0.02 m and then has no outline left.
const SHORTEST_SIDE: f32 = 0.025;
/// Least area of a polygon in squares of its greatest coordinate: with less, the centre of mass is
/// lost in the rounding of single precision.
const LEAST_AREA: f32 = 1e-3;

/// Something wrong at a place of the document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where, as a JSON path: `$.joints[3].limits`.
    pub path: String,
    /// What is wrong and what was expected.
    pub reason: String,
}

impl Problem {
    /// Names from the file stand in both; what would break the line is escaped.
    fn new(path: String, reason: String) -> Self {
        let escaped = |c: char| match c.is_control() {
            true => c.escape_default().collect(),
            false => String::from(c),
        };
        let line = |text: String| text.chars().map(escaped).collect();
        Self { path: line(path), reason: line(reason) }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path, self.reason)
    }
}

/// Why a creature file is refused.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum BodyError {
    #[error("$: a creature file has at most {MOST_BYTES} bytes, this one {0}")]
    TooLong(usize),
    #[error("$: not JSON: {0}")]
    Json(serde_json::Error),
    #[error("{0}")]
    Shape(Problem),
    #[error("$.format: this is format {found}, this version reads {FORMAT_VERSION}: update Ambulo")]
    Version { found: u64 },
    #[error("{}", .0.iter().map(Problem::to_string).collect::<Vec<_>>().join("\n"))]
    Invalid(Vec<Problem>),
}

impl BodyError {
    /// Each thing that is wrong and where.
    pub fn problems(&self) -> Vec<Problem> {
        match self {
            BodyError::Invalid(problems) => problems.clone(),
            BodyError::Shape(problem) => vec![problem.clone()],
            other => {
                let text = other.to_string();
                let (path, reason) = text.split_once(": ").expect("each text begins with a path");
                vec![Problem { path: path.into(), reason: reason.into() }]
            }
        }
    }
}

/// JSON to a description; its numbers are not checked yet.
pub(crate) fn parse(text: &str) -> Result<Description, BodyError> {
    if text.len() > MOST_BYTES {
        return Err(BodyError::TooLong(text.len()));
    }
    let value: serde_json::Value = serde_json::from_str(text).map_err(BodyError::Json)?;
    // The version first: a later format may have fields that this one does not know.
    if let Some(found) = value.get("format").and_then(serde_json::Value::as_u64)
        && found != u64::from(FORMAT_VERSION)
    {
        return Err(BodyError::Version { found });
    }
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = error.path().to_string();
        let path = if path == "." { "$".into() } else { format!("$.{path}") };
        BodyError::Shape(Problem::new(path, error.into_inner().to_string()))
    })
}

/// Everything that is wrong with a description; empty if nothing is.
pub(crate) fn problems(creature: &Description) -> Vec<Problem> {
    let mut found = Found::default();
    check_counts(creature, &mut found);
    for (index, part) in creature.parts.iter().enumerate() {
        check_part(part, &format!("$.parts[{index}]"), &mut found);
    }
    for (index, joint) in creature.joints.iter().enumerate() {
        check_joint(joint, &format!("$.joints[{index}]"), &mut found);
    }
    for (index, sensor) in creature.sensors.iter().enumerate() {
        check_sensor(sensor, index, &creature.sensors, &mut found);
    }
    check_tree(creature, &mut found);
    check_pairs(creature, &mut found);
    found.0
}

#[derive(Default)]
struct Found(Vec<Problem>);

impl Found {
    fn add(&mut self, path: impl Into<String>, reason: impl Into<String>) {
        self.0.push(Problem::new(path.into(), reason.into()));
    }

    /// Finite and within `low..=high`.
    fn number(&mut self, path: String, value: f32, low: f32, high: f32, unit: &str) {
        if !(low..=high).contains(&value) {
            self.add(path, format!("{value} is not {low} to {high}{unit}"));
        }
    }

    /// Above 0 and at most `high`.
    fn positive(&mut self, path: String, value: f32, high: f32, unit: &str) {
        if !(value > 0.0 && value <= high) {
            self.add(path, format!("{value} is not above 0 and at most {high}{unit}"));
        }
    }

    fn name(&mut self, path: String, name: &str) {
        let plain = |c: char| !c.is_control();
        if name.trim().is_empty() || name.chars().count() > 80 || !name.chars().all(plain) {
            self.add(path, "a name is 1 to 80 characters, none of them a control character");
        }
    }
}

fn check_counts(creature: &Description, found: &mut Found) {
    if creature.format != FORMAT_VERSION {
        found.add("$.format", format!("{} is not {FORMAT_VERSION}", creature.format));
    }
    found.name("$.name".into(), &creature.name);
    let parts = creature.parts.len();
    if !(2..=MOST_PARTS).contains(&parts) {
        found.add("$.parts", format!("{parts} parts; a creature has 2 to {MOST_PARTS}"));
    }
    let torsos: Vec<_> = tagged(creature, Tag::Torso).collect();
    match torsos[..] {
        [_] => {}
        [] => found.add("$.parts", "no part has the tag torso; exactly one must"),
        [_, second, ..] => found.add(
            format!("$.parts[{second}].tags"),
            format!("a second torso beside $.parts[{}]; exactly one part is the torso", torsos[0]),
        ),
    }
    if creature.sensors.is_empty() {
        found.add("$.sensors", "none; a controller must be told something");
    }
}

fn tagged(creature: &Description, tag: Tag) -> impl Iterator<Item = usize> + '_ {
    creature.parts.iter().enumerate().filter(move |(_, p)| p.tags.contains(&tag)).map(|(i, _)| i)
}

fn check_part(part: &Part, path: &str, found: &mut Found) {
    found.name(format!("{path}.name"), &part.name);
    for axis in 0..2 {
        found.number(format!("{path}.position[{axis}]"), part.position[axis], -100.0, 100.0, " m");
    }
    found.number(format!("{path}.angle"), part.angle, -7.0, 7.0, " rad");
    found.number(format!("{path}.density"), part.density, 0.1, 1e4, " kg/m²");
    found.number(format!("{path}.friction"), part.friction, 0.0, 10.0, "");
    let size = |found: &mut Found, key: &str, value| {
        found.number(format!("{path}.shape.{key}"), value, 0.01, 20.0, " m");
    };
    match &part.shape {
        Shape::Box { width, height } => {
            for (key, side) in [("width", *width), ("height", *height)] {
                let path = format!("{path}.shape.box.{key}");
                found.number(path, side, SHORTEST_SIDE, 20.0, " m");
            }
        }
        Shape::Circle { radius } => size(found, "circle.radius", *radius),
        Shape::Capsule { length, radius } => {
            size(found, "capsule.length", *length);
            size(found, "capsule.radius", *radius);
        }
        shape @ Shape::Polygon { points } => {
            let path = format!("{path}.shape.polygon.points");
            if check_corners(points, &path, found) && check_convex(points, &path, found) {
                check_extent(shape, points, &path, found);
            }
        }
    }
}

fn check_corners(points: &[[f32; 2]], path: &str, found: &mut Found) -> bool {
    let before = found.0.len();
    let count = points.len();
    if !(3..=8).contains(&count) {
        found.add(path, format!("{count} corners; a polygon has 3 to 8"));
    }
    for (index, point) in points.iter().enumerate() {
        for (axis, &value) in point.iter().enumerate() {
            found.number(format!("{path}[{index}][{axis}]"), value, -20.0, 20.0, " m");
        }
    }
    found.0.len() == before
}

/// One turn around, always to the same side.
fn check_convex(points: &[[f32; 2]], path: &str, found: &mut Found) -> bool {
    let count = points.len();
    let edge = |i: usize| {
        let ([ax, ay], [bx, by]) = (points[i % count], points[(i + 1) % count]);
        [bx - ax, by - ay]
    };
    let mut turned = 0.0;
    let mut signs = [false; 2];
    for i in 0..count {
        let ([ax, ay], [bx, by]) = (edge(i), edge(i + 1));
        let (long, next) = (ax.hypot(ay), bx.hypot(by));
        if long < SHORTEST_SIDE {
            let reason = format!("the edge from here is {long} m long; at least {SHORTEST_SIDE} m");
            found.add(format!("{path}[{i}]"), reason);
            return false;
        }
        let (cross, dot) = (ax * by - ay * bx, ax * bx + ay * by);
        turned += cross.atan2(dot);
        // Straight on is refused, too: such a corner is none.
        if cross.abs() < 1e-3 * long * next {
            let corner = (i + 1) % count;
            found.add(format!("{path}[{corner}]"), "the outline does not turn here");
            return false;
        }
        signs[usize::from(cross > 0.0)] = true;
    }
    let convex = signs != [true, true] && turned.abs() < 7.0;
    if !convex {
        found.add(path, "not convex; split the part, or join two convex ones by a joint");
    }
    convex
}

/// Neither too thin for the engine nor too far away for its centre to be known.
fn check_extent(polygon: &Shape, points: &[[f32; 2]], path: &str, found: &mut Found) {
    let width = width(points);
    if width < SHORTEST_SIDE {
        found.add(path, format!("{width} m across; at least {SHORTEST_SIDE} m"));
    }
    let far = points.iter().flatten().fold(0.0, |far: f32, value| far.max(value.abs()));
    if polygon.area() < LEAST_AREA * far * far {
        let reason = "too small for its distance from 0, the origin of its part: move it there";
        found.add(path, reason);
    }
}

/// Of a convex polygon where it is narrowest, metres.
fn width(points: &[[f32; 2]]) -> f32 {
    let across = |i: usize| {
        let ([ax, ay], [bx, by]) = (points[i], points[(i + 1) % points.len()]);
        let (ex, ey) = (bx - ax, by - ay);
        let off = |[x, y]: &[f32; 2]| ((x - ax) * ey - (y - ay) * ex).abs() / ex.hypot(ey);
        points.iter().map(off).fold(0.0, f32::max)
    };
    (0..points.len()).map(across).fold(f32::INFINITY, f32::min)
}

fn check_joint(joint: &Joint, path: &str, found: &mut Found) {
    found.name(format!("{path}.name"), &joint.name);
    for axis in 0..2 {
        found.number(format!("{path}.anchor[{axis}]"), joint.anchor[axis], -100.0, 100.0, " m");
    }
    let [low, high] = joint.limits;
    if !(low.is_finite() && high.is_finite()) {
        found.add(format!("{path}.limits"), format!("[{low}, {high}] is not finite"));
    } else if low >= high {
        let reason = format!("[{low}, {high}] is the wrong way round: the lower limit comes first");
        found.add(format!("{path}.limits"), reason);
    } else if low > 0.0 || high < 0.0 {
        let reason = format!("[{low}, {high}] leaves the start pose, 0, outside");
        found.add(format!("{path}.limits"), reason);
    } else if low < -3.1 || high > 3.1 {
        found.add(
            format!("{path}.limits"),
            format!("[{low}, {high}] is not within -3.1 to 3.1 rad"),
        );
    }
    found.positive(format!("{path}.torque"), joint.torque, 1e5, " N·m");
    found.positive(format!("{path}.speed"), joint.speed, 100.0, " rad/s");
}

fn check_sensor(sensor: &Sensor, index: usize, all: &[Sensor], found: &mut Found) {
    let path = format!("$.sensors[{index}]");
    if let Sensor::GroundRays { count, reach } = *sensor {
        if !(1..=16).contains(&count) {
            found.add(format!("{path}.ground_rays.count"), format!("{count} is not 1 to 16"));
        }
        found.number(format!("{path}.ground_rays.reach"), reach, 0.1, 50.0, " m");
    }
    let same = |other: &Sensor| std::mem::discriminant(other) == std::mem::discriminant(sensor);
    if all[..index].iter().any(same) {
        found.add(path, "listed twice");
    }
}

/// Names that are unique, and a tree that has the torso as its root.
fn check_tree(creature: &Description, found: &mut Found) {
    let mut index = HashMap::new();
    for (i, part) in creature.parts.iter().enumerate() {
        if index.insert(part.name.as_str(), i).is_some() {
            found.add(format!("$.parts[{i}].name"), format!("a second part '{}'", part.name));
        }
    }
    let mut names = HashMap::new();
    let mut parent: Vec<Option<(usize, usize)>> = vec![None; creature.parts.len()];
    for (j, joint) in creature.joints.iter().enumerate() {
        let path = format!("$.joints[{j}]");
        if names.insert(joint.name.as_str(), j).is_some() {
            found.add(format!("{path}.name"), format!("a second joint '{}'", joint.name));
        }
        let mut ends = [None, None];
        for (end, (key, name)) in
            [("parent", &joint.parent), ("child", &joint.child)].iter().enumerate()
        {
            ends[end] = index.get(name.as_str()).copied();
            if ends[end].is_none() {
                found.add(format!("{path}.{key}"), format!("no part is called '{name}'"));
            }
        }
        let (Some(above), Some(below)) = (ends[0], ends[1]) else { continue };
        if above == below {
            found.add(path, "joins a part to itself");
        } else if creature.parts[below].tags.contains(&Tag::Torso) {
            found.add(format!("{path}.child"), "the torso hangs on nothing: let it be the parent");
        } else if let Some((_, other)) = parent[below] {
            found.add(
                format!("{path}.child"),
                format!("a loop: '{}' already hangs on $.joints[{other}]", joint.child),
            );
        } else {
            parent[below] = Some((above, j));
        }
    }
    let mut torsos = tagged(creature, Tag::Torso);
    let (Some(torso), None) = (torsos.next(), torsos.next()) else { return };
    for (i, part) in creature.parts.iter().enumerate() {
        // Up the tree, but never farther than there are parts.
        let mut at = i;
        for _ in 0..creature.parts.len() {
            match parent[at] {
                Some((above, _)) => at = above,
                None => break,
            }
        }
        if at == torso {
            continue;
        }
        let path = format!("$.parts[{i}]");
        if parent[at].is_some() {
            found.add(path, format!("a loop: following '{}' upwards never ends", part.name));
        } else if at == i {
            found.add(
                path,
                format!("'{}' hangs on nothing: no joint has it as its child", part.name),
            );
        }
    }
}

fn check_pairs(creature: &Description, found: &mut Found) {
    let joints: HashSet<_> = creature.joints.iter().map(|joint| joint.name.as_str()).collect();
    let mut used = HashMap::new();
    for (p, pair) in creature.pairs.iter().enumerate() {
        for (side, name) in pair.iter().enumerate() {
            let path = format!("$.pairs[{p}][{side}]");
            if !joints.contains(name.as_str()) {
                found.add(path, format!("no joint is called '{name}'"));
            } else if let Some(other) = used.insert(name.as_str(), p) {
                found.add(path, format!("'{name}' is in $.pairs[{other}] already"));
            }
        }
    }
}
