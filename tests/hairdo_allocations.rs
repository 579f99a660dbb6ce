//! What reading a hairdo allocates: never more than a few times the file, whatever the file says of
//! itself. And a snapshot that is taken again: nothing. Counted by a global allocator, so this is a binary of its own.
#![cfg(feature = "save")]

use bevy::prelude::*;
use bevy_keratin::prelude::*;
use counting::most;
use std::time::Instant;

#[allow(unsafe_code, reason = "an allocator cannot be without")]
mod counting {
    use std::{
        alloc::{GlobalAlloc, Layout, System},
        cell::Cell,
    };

    thread_local! {
        /// Bytes that are held now, and the most since counting began.
        static HELD: Cell<(isize, isize)> = const { Cell::new((0, 0)) };
    }

    fn note(change: isize) {
        // A thread that is ending has no cell any more, and nothing to be counted.
        let _ = HELD.try_with(|held| {
            let (now, most) = held.get();
            let now = now + change;
            held.set((now, most.max(now)));
        });
    }

    struct Counting;

    // SAFETY: everything is the system allocator's; counting allocates nothing.
    unsafe impl GlobalAlloc for Counting {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            note(layout.size() as isize);
            unsafe { System.alloc(layout) }
        }
        unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
            note(-(layout.size() as isize));
            unsafe { System.dealloc(at, layout) }
        }
    }

    #[global_allocator]
    static ALLOCATOR: Counting = Counting;

    /// What `act` gives, and the most bytes that it held at once.
    pub fn most<T>(act: impl FnOnce() -> T) -> (T, usize) {
        HELD.set((0, 0));
        let result = act();
        (result, HELD.get().1.max(0) as usize)
    }
}

fn groom(strands: usize, nodes: usize) -> (World, Entity) {
    let mut world = World::new();
    let hair = world.spawn(Hair).id();
    for s in 0..strands {
        let root = Vec3::X * 0.01 * s as f32;
        let line: Vec<Vec3> = (0..nodes).map(|i| root + Vec3::Y * 0.02 * i as f32).collect();
        world.spawn((StrandOf(hair), Strand::from_polyline(&line).unwrap()));
    }
    (world, hair)
}

/// A file of these numbers with the checksum that it should have.
fn sealed(payload: &[u8]) -> Vec<u8> {
    let mut file = b"\x8bhairdo\n\x01\x00".to_vec();
    file.extend((payload.len() as u64).to_le_bytes());
    file.extend(payload);
    let bit = |s: u32| if s & 1 == 1 { 0xEDB8_8320 ^ (s >> 1) } else { s >> 1 };
    let sum = file.iter().fold(!0, |sum, b| (0..8).fold(sum ^ u32::from(*b), |s, _| bit(s)));
    file.extend((!sum).to_le_bytes());
    file
}

/// The least bytes that a count takes as a varint.
fn varint(mut count: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while count > 127 {
        bytes.push(count as u8 | 128);
        count >>= 7;
    }
    bytes.push(count as u8);
    bytes
}

#[test]
fn a_head_is_saved_and_loaded_at_once_and_takes_a_few_times_its_file() {
    let (mut world, hair) = groom(10_000, 16);
    let start = Instant::now();
    let hairdo = Hairdo::of(&world, hair).unwrap();
    let taken = start.elapsed();
    let bytes = hairdo.to_bytes();
    let written = start.elapsed() - taken;
    let start = Instant::now();
    let (read, held) = most(|| Hairdo::from_bytes(&bytes).unwrap());
    let loaded = start.elapsed();
    read.apply(&mut world, hair).unwrap();
    let worn = start.elapsed() - loaded;
    println!(
        "10,000 strands of 16 nodes: {} kB, taken in {taken:?}, written in {written:?}, read in \
         {loaded:?}, put on in {worn:?}; reading held {} kB",
        bytes.len() / 1000,
        held / 1000
    );
    assert_eq!(read, hairdo);
    assert!(held < 12 * bytes.len(), "{held} of {}", bytes.len());
}

#[test]
fn a_snapshot_into_a_reused_value_allocates_nothing() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::new(FixedPostUpdate)));
    let hair = app.world_mut().spawn(Hair).id();
    for s in 0..10_000u16 {
        let root = Vec3::new(f32::from(s % 100), 0.0, f32::from(s / 100)) * 0.003;
        let line: Vec<Vec3> = (0..16).map(|i| root + Vec3::Y * 0.01 * i as f32).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&line).unwrap()));
    }
    run_ticks(&mut app, 3);
    let take = move |mut hairs: HairSnapshots,
                     mut own: Local<HairSnapshot>,
                     mut world: Local<HairWorldSnapshot>| {
        let start = Instant::now();
        let (taken, held) =
            most(|| hairs.take(hair, &mut own).and_then(|()| hairs.take_world(&mut world)));
        (taken, held, start.elapsed(), own.size())
    };
    let take = app.world_mut().register_system(take);
    let mut run = || app.world_mut().run_system(take).unwrap();
    let (first, second) = (run(), run());
    let quickest = (0..10).map(|_| run().2).min();
    let mut snapshot = HairSnapshot::default();
    let back = move |mut hairs: HairSnapshots| {
        hairs.take(hair, &mut snapshot).unwrap();
        let start = Instant::now();
        hairs.restore(hair, &snapshot).map(|()| start.elapsed())
    };
    let back = app.world_mut().register_system(back);
    let mut restore = || app.world_mut().run_system(back).unwrap().unwrap();
    println!(
        "10,000 strands of 16 nodes: {} bytes a strand, taken in {quickest:?}, put back in {:?}",
        second.3 / 10_000,
        (0..10).map(|_| restore()).min()
    );
    assert!(first.0.is_ok() && first.1 > 0 && first.3 == second.3);
    assert_eq!((second.0, second.1), (Ok(()), 0));
}

/// Bytes that a strand of 16 nodes takes in a snapshot, half a second after something is done to it.
fn bytes_of_a_strand(done: impl Fn(&mut World, Entity)) -> usize {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::new(FixedPostUpdate)));
    let hair = app.world_mut().spawn(Hair).id();
    for s in 0..50u16 {
        let root = Vec3::X * 0.01 * f32::from(s);
        let line: Vec<Vec3> = (0..16).map(|i| root + Vec3::Y * 0.01 * i as f32).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&line).unwrap()));
    }
    run_ticks(&mut app, 2);
    done(app.world_mut(), hair);
    run_ticks(&mut app, 30);
    let size = move |mut hairs: HairSnapshots| {
        let mut own = HairSnapshot::default();
        hairs.take(hair, &mut own).map(|()| own.size())
    };
    let size = app.world_mut().register_system(size);
    app.world_mut().run_system(size).unwrap().unwrap() / 50
}

/// Bytes of what hair shares, for each of ten things.
fn bytes_shared(each: impl Fn(&mut World, f32)) -> usize {
    let size = |count: usize| {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, HairPlugins::new(FixedPostUpdate)));
        (0..count).for_each(|i| each(app.world_mut(), i as f32));
        run_ticks(&mut app, 2);
        let size = |mut hairs: HairSnapshots| {
            let mut shared = HairWorldSnapshot::default();
            hairs.take_world(&mut shared).map(|()| shared.size())
        };
        let size = app.world_mut().register_system(size);
        app.world_mut().run_system(size).unwrap().unwrap()
    };
    (size(20) - size(10)) / 10
}

#[test]
fn a_snapshot_is_as_large_as_the_book_says() {
    let collider = bytes_shared(|world, _| {
        world.spawn(HairCollider::sphere(0.1).unwrap());
    });
    let droplet = bytes_shared(|world, i| {
        world.spawn(Droplet::new(Vec3::X * i, 4e-9).unwrap());
    });
    println!("a collider {collider}, a droplet {droplet} bytes");
    assert!(collider.abs_diff(400) < 50 && droplet.abs_diff(100) < 30, "{collider} {droplet}");
    let breeze = HairWind { velocity: Vec3::X, ..default() };
    let dry = bytes_of_a_strand(|_, _| {});
    let treated = bytes_of_a_strand(|world, hair| world.trigger(HairTreatment::wet(hair)));
    let wet = bytes_of_a_strand(|world, hair| world.trigger(SoakHair::dripping(hair)));
    let blown = bytes_of_a_strand(|world, hair| {
        world.insert_resource(breeze);
        world.trigger(SoakHair::dripping(hair));
    });
    println!("dry {dry}, treated {treated}, wet {wet}, wet in a breeze {blown} bytes");
    let book = [(dry, 1800), (treated, 2600), (wet, 3200), (blown, 4200)];
    assert!(book.iter().all(|(bytes, book)| bytes.abs_diff(*book) < 100), "{book:?}");
}

#[test]
fn counts_that_lie_reserve_nothing() {
    let (world, hair) = groom(2, 9);
    let good = Hairdo::of(&world, hair).unwrap().to_bytes();
    let payload = &good[18..good.len() - 4];
    assert_eq!(sealed(payload), good);
    for count in [3, 100, 1000, 1 << 20, 1 << 32, 1 << 40, u64::MAX / 128, u64::MAX] {
        // strands, then nodes of the first
        let strands: Vec<u8> = varint(count).into_iter().chain(payload[1..].to_vec()).collect();
        let nodes = [&payload[..2], &varint(count), &payload[3..]].concat();
        for lie in [sealed(&strands), sealed(&nodes)] {
            let (result, held) = most(|| Hairdo::from_bytes(&lie).is_err());
            assert!(result, "{count}");
            assert!(held < 12 * lie.len() + 1000, "{count}: {held} of {}", lie.len());
        }
    }
    // a length that lies
    let mut lie = good.clone();
    lie[10..18].fill(0xff);
    let (result, held) = most(|| Hairdo::from_bytes(&lie).is_err());
    assert!(result && held < 1000, "{held}");
}
