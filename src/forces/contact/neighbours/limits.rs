//! Tests of how much lists may hold, and of searching twice.

use super::{tests::printed, *};

#[test]
fn lists_of_crowded_hair_take_no_more_memory_than_allowed() {
    let mut list = Neighbours::default();
    for k in 0..600 {
        let at = |i: usize| Vec3::new(1e-6 * k as f32, 4e-3 * i as f32, 0.0);
        list.add(&[at(0), at(1), at(2), at(3)], 1);
    }
    let bytes = |list: &Neighbours| -> usize {
        list.parts.iter().map(|part| part.groups.len() * size_of::<EdgeGroup>()).sum()
    };
    list.find_pushes(printed(1e-3), Lookup::Now);
    let (all, expected) = (bytes(&list), list.pushes().nth(1).unwrap());
    assert!(all > 4 << 20 && !list.is_crowded());
    list.look_up(simd_level(), 2e-3, 1 << 20);
    assert!((1 << 19..=1 << 20).contains(&bytes(&list)), "{} of {all}", bytes(&list));
    assert!(list.is_crowded());
    // The nearest are kept.
    assert!(list.parts.iter().flat_map(|part| &part.slacks).all(|slack| !slack.is_nan()));
    list.find_pushes(printed(1e-3), Lookup::Now);
    let push = list.pushes().nth(1).unwrap();
    assert!(push.is_finite() && push.length() < expected.length());
    list.look_up(simd_level(), 2e-3, all);
    assert!(bytes(&list) == all && !list.is_crowded());
}

#[test]
fn a_second_search_of_the_same_nodes_is_the_first() {
    let strand = |z: f32| (0..5).map(move |i| Vec3::new(0.01 * i as f32, 0.0, z));
    let mut list = Neighbours::default();
    for z in [0.0, 1e-3] {
        list.add(&strand(z).collect::<Vec<_>>(), 1);
        list.expect(strand(z + 4e-4));
    }
    let mut search = |reach: f32| {
        list.find_pushes(printed(reach), Lookup::Now);
        (list.pushes().collect::<Vec<_>>(), list.rows.len(), list.lists.rows.clone())
    };
    let first = search(1e-3);
    search(2e-3);
    let again = search(1e-3);
    assert_eq!((&first.0, first.1), (&again.0, again.1));
    // Padding is not a number.
    assert_eq!(format!("{:?}", first.2), format!("{:?}", again.2));
}
