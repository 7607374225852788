//! Learn a gait while a level loads: a search gets a part of every frame, and the frame goes on.
//!
//!     cargo run --release -p ambulo-arena --example while_loading -- my_creature.json

use std::time::{Duration, Instant};

use ambulo_arena::{Arena, Learner, Settings, Until};
use ambulo_body::Body;

/// What a frame of the game leaves for learning.
const BUDGET: Duration = Duration::from_millis(4);
const HOPPER: &str = include_str!("../tests/creatures/hopper.json");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = match std::env::args().nth(1) {
        Some(path) => std::fs::read_to_string(path)?,
        None => HOPPER.to_owned(),
    };
    let settings = Settings::parse(r#"{"task": {"name": "run"}}"#)?;
    let mut learner = Learner::new(Arena::new(Body::parse(&text)?, settings)?)?;
    let (mut frames, mut longest, began) = (0, Duration::ZERO, Instant::now());
    while !learner.has(Until::Usable) && learner.evolution().generation() < 300 {
        let frame = Instant::now();
        if let Some(told) = learner.work(BUDGET)? {
            let (generation, best) = (learner.evolution().generation(), told.best);
            println!("frame {frames}: generation {generation}, best {best:.2}");
        }
        frames += 1;
        longest = longest.max(frame.elapsed());
        // The game's own work would come here.
    }
    let Some(champion) = learner.champion().filter(|champion| champion.is(Until::Usable)) else {
        return Err("no usable gait: see the creature's motors and limits".into());
    };
    println!(
        "usable after {frames} frames of {BUDGET:?} and {:.2} s; the longest took {longest:.1?}",
        began.elapsed().as_secs_f64()
    );
    // The controller that the game goes on with: senses in, motor speeds out.
    let pilot = learner.arena().pilot(&champion.genome)?;
    println!(
        "its controller has {} genes and drives {} joints",
        pilot.genome().len(),
        pilot.joints()
    );
    Ok(())
}
