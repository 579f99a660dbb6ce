//! Hair whose locks touch comes to rest.
#![cfg(all(feature = "groom", feature = "save"))]

use crate::{
    common::{app_with_meshes, run},
    worlds_measured::wearer,
};
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use std::{thread::sleep, time::Duration};

/// Strands of a preset that sleep, and that do not, seconds after it was put on a head that stands still.
fn asleep(contact: StrandContact) -> SleepCounts {
    let mut app = app_with_meshes(60.0);
    let head = app.world_mut().resource_mut::<Assets<Mesh>>().add(wearer::ball(0.1));
    app.world_mut().spawn((Mesh3d(head), Transform::default(), WearHair::new(HairPreset::Wavy)));
    let worn = (0..4000).find_map(|_| {
        app.update();
        sleep(Duration::from_millis(2));
        let world = app.world_mut();
        world.query_filtered::<Entity, (With<WornHair>, With<Strands>)>().iter(world).next()
    });
    let hair = worn.expect("no hair is worn after 8 s");
    app.world_mut().entity_mut(hair).insert(contact);
    run(&mut app, 5.0);
    *app.world().get::<SleepCounts>(hair).unwrap()
}

#[test]
fn locks_that_touch_come_to_rest_where_contact_is_mutual() {
    let [mutual, printed] =
        [true, false].map(|mutual| asleep(StrandContact { mutual, ..default() }));
    println!("mutual {mutual:?}, printed {printed:?}");
    assert!(mutual.asleep > mutual.awake, "{mutual:?}");
    assert!(2 * printed.asleep < printed.awake, "{printed:?}, the control");
}
