//! A character that walks, sits down and gets up allocates nothing a frame. Alone in its program,
//! since it counts what the whole program allocates.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use ambulo_control::Intent;
use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_scene::{Act, Actor, Physics, STEP, Told, Wish};
use common::playground::{Playground, model};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u32> = const { Cell::new(0) };
}

fn count() {
    ALLOCATIONS.with(|count| count.set(count.get() + 1));
}

// SAFETY: everything is handed on to the system's allocator as it came.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn allocations() -> u32 {
    ALLOCATIONS.with(Cell::get)
}

#[test]
fn a_frame_allocates_nothing() {
    let place = Playground::read(&model());
    let mut physics = Physics::new(&place.scene).unwrap();
    physics.place_character(Vec3::new(-2.4, 0.0, 1.5), 0.2, 1.75).unwrap();
    let (start, body, moves) = (Vec2::new(-2.4, 1.5), place.body.clone(), place.moves.clone());
    let mut actor = Actor::new(&place.model, body, moves, start, -1.6, &physics).unwrap();
    let object = place.scene.object("chair").unwrap();
    let (object, which) = actor.offers(&physics).find(|&(on, _)| on == object).unwrap();
    let intent = Intent { velocity: Vec2::X, ..Intent::default() };
    let (mut counted, mut sat, mut ended) = (0, false, false);
    for frame in 0..900 {
        let act = (frame == 30).then_some(Act::Begin { object, which });
        let wish = if sat { Wish { intent, act } } else { Wish { act, ..Wish::default() } };
        let before = allocations();
        let told = actor.step(STEP, &wish, &mut physics).told;
        let between = allocations();
        physics.step(STEP).unwrap();
        let after = allocations();
        actor.pose(STEP, &mut physics);
        // The first frames meet the walls around, whose list grows.
        if frame >= 30 {
            counted += (between - before) + (allocations() - after);
        }
        sat |= told == Some(Told::Holds);
        ended |= told == Some(Told::Ended);
    }
    assert!(sat && ended);
    assert_eq!(counted, 0);
}
