//! What all layers of one character cost on one core, and what they hold in memory.
//!
//! A frame is: two poses of a walk cross-faded, an inertialiser in the middle of a transition, hips
//! that both hands and both feet want something of, two hands that reach, a head that looks, and
//! both feet placed, on flat ground and on a height field. The body is that of the starters, with 22
//! joints. Both kinds of ground take turns, a repeat of each, so that a machine that slows down slows
//! all; medians and quartiles are over the repeats, of the mean frame of each. Timing a stage costs
//! some 20 ns, which is counted apart and taken off.
//!
//! ```text
//! cargo bench -p ambulo-layers --bench layers [-- --json] [-- --repeats 41]
//! ```

#[path = "../../tests/ik/walk.rs"]
mod walk;

mod body;
mod character;
mod counting;

use std::time::Instant;

use ambulo_rig::{Flat, HeightField, Terrain};
use body::Loop;
use character::{Character, STAGES, Timer};

/// A character's layers hold no more, bytes.
const MOST_BYTES: usize = 1_000_000;
const FRAMES: usize = 600;

/// Lower quartile, median, upper quartile.
fn quartiles(mut numbers: Vec<f64>) -> [f64; 3] {
    numbers.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|share| numbers[(share * (numbers.len() - 1) as f64).round() as usize])
}

/// Nanoseconds of timing one stage.
fn clock() -> f64 {
    let mut timer = Timer::new();
    let start = Instant::now();
    for _ in 0..100_000 {
        timer.lap(0);
    }
    start.elapsed().as_nanos() as f64 / 1e5
}

/// Microseconds a frame: of each stage, and of a whole frame that nobody times in between.
fn repeat(motion: &Loop, terrain: &dyn Terrain, clock: f64) -> Vec<f64> {
    let mut character = Character::new(&motion.skeleton);
    let mut timer = Timer::new();
    let mut staged = vec![0.0; STAGES.len()];
    for frame in 0..FRAMES {
        timer.start();
        character.frame(motion, frame, terrain, Some(&mut timer));
    }
    for (staged, nanoseconds) in staged.iter_mut().zip(timer.nanoseconds()) {
        *staged = (nanoseconds as f64 / FRAMES as f64 - clock).max(0.0) / 1e3;
    }
    let mut character = Character::new(&motion.skeleton);
    let start = Instant::now();
    for frame in 0..FRAMES {
        character.frame(motion, frame, terrain, None);
    }
    staged.push(start.elapsed().as_nanos() as f64 / FRAMES as f64 / 1e3);
    staged
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let json = arguments.iter().any(|argument| argument == "--json");
    let after = |name| arguments.iter().position(|a| a == name).map(|at| &arguments[at + 1..]);
    let repeats = after("--repeats").and_then(|rest| rest.first()).map_or(41, |number| {
        number.parse().ok().filter(|&n: &usize| n > 0).expect("--repeats takes a number above 0")
    });

    let motion = Loop::new();
    let (character, bytes) = counting::held(|| Character::new(&motion.skeleton));
    drop(character);
    assert!(bytes <= MOST_BYTES, "a character's layers hold {bytes} bytes");

    let hills = HeightField::hills(3, 160.0, 3.0).expect("sizes are fine");
    let grounds: [(&str, &dyn Terrain); 2] = [("flat", &Flat(0.0)), ("height field", &hills)];
    let mut measured = [vec![], vec![]];
    let clock = clock();
    for _ in 0..repeats {
        for (ground, measured) in grounds.iter().zip(&mut measured) {
            measured.push(repeat(&motion, ground.1, clock));
        }
    }
    let rows = || STAGES.iter().copied().chain(["all, untimed inside"]).enumerate();
    let of = |ground: usize, stage: usize| {
        quartiles(measured[ground].iter().map(|repeat| repeat[stage]).collect())
    };
    if json {
        let stages = rows().map(|(at, stage)| {
            let [flat, field] = [of(0, at), of(1, at)];
            (stage.to_owned(), serde_json::json!({ "flat": flat, "height_field": field }))
        });
        let report = serde_json::json!({
            "joints": motion.skeleton.len(), "frames": FRAMES, "repeats": repeats,
            "microseconds_a_frame_quartiles": stages.collect::<serde_json::Map<_, _>>(),
            "bytes_a_character": bytes,
        });
        println!("{report:#}");
        return;
    }
    println!(
        "µs a frame, {} joints: median (quartiles) of {repeats} repeats",
        motion.skeleton.len()
    );
    println!("{:<22}{:>22}{:>22}", "", grounds[0].0, grounds[1].0);
    for (at, stage) in rows() {
        let cell = |[low, median, high]: [f64; 3]| format!("{median:.2} ({low:.2}–{high:.2})");
        println!("{stage:<22}{:>22}{:>22}", cell(of(0, at)), cell(of(1, at)));
    }
    println!("held by one character: {bytes} bytes (states, layers and buffers)");
}
