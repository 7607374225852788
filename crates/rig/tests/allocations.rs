//! Nothing is allocated while poses are retargeted: an allocator that counts, on this thread.
#![allow(unsafe_code)] // Only an allocator can tell, and only `unsafe` makes one.

mod people;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use ambulo_rig::{Retarget, Stance};
use people::{arms, plain, splayed, standing};

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: the system's allocator does it all; the counter allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_pose_allocates_nothing() {
    let (from, to) = (plain(), splayed());
    let mut retarget = Retarget::new(&Stance::rest(&from), &Stance::rest(&to)).unwrap();
    let (pose, mut made) = (standing(0.5, 0.3, arms(1.0)), to.rest_pose());
    let before = COUNT.with(Cell::get);
    for _ in 0..10 {
        retarget.pose(&pose, &mut made);
    }
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert_ne!(before, 0, "it counts");
}
