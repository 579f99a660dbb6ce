//! Game code learns where strands are, wherever they are simulated.

use crate::{residence::on_gpu, stage::Stage};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

#[derive(Resource, Default)]
struct Probes(Vec<HairProbed>);

pub fn probes_tell_where_strands_are(stage: &mut Stage) {
    stage.app.init_resource::<Probes>();
    let observer = stage
        .app
        .world_mut()
        .add_observer(|probed: On<HairProbed>, mut probes: ResMut<Probes>| {
            probes.0.push(probed.clone());
        })
        .id();
    // More than are asked about at once; half of them do not matter to anybody.
    on_gpu(stage, 140, 2);
    let members = stage.members();
    let asked: Vec<Entity> = members.iter().copied().step_by(2).collect();
    asked.iter().for_each(|e| _ = stage.app.world_mut().entity_mut(*e).insert(HairProbe));
    let mut past = vec![stage.strands()];
    let (mut answered, mut oldest) = (vec![0; members.len()], 0);
    for _ in 0..20 {
        stage.run(1);
        for probe in core::mem::take(&mut stage.app.world_mut().resource_mut::<Probes>().0) {
            let strand = members.iter().position(|e| *e == probe.entity).unwrap();
            let then = &past[past.len() - 1 - probe.age as usize][strand];
            assert_eq!(probe.positions, then.positions(), "{} ticks ago", probe.age);
            answered[strand] += 1;
            oldest = oldest.max(probe.age);
        }
        past.push(stage.strands());
    }
    assert!(stage.is_on_gpu());
    println!("answered {answered:?} times, up to {oldest} ticks later");
    let (known, unknown): (Vec<_>, Vec<_>) =
        answered.iter().enumerate().partition(|(i, _)| i % 2 == 0);
    assert!(known.iter().all(|(_, times)| **times > 1) && oldest < 6);
    assert!(unknown.iter().all(|(_, times)| **times == 0));
    // On the CPU every frame answers with the present.
    stage.app.world_mut().entity_mut(stage.hair).insert(SimulateOn::Cpu);
    stage.run(2);
    let now = stage.strands();
    stage.app.world_mut().resource_mut::<Probes>().0.clear();
    stage.run(1);
    let probes = core::mem::take(&mut stage.app.world_mut().resource_mut::<Probes>().0);
    assert_eq!(probes.len(), asked.len());
    for probe in probes {
        let strand = members.iter().position(|e| *e == probe.entity).unwrap();
        assert_eq!((probe.age, &probe.positions[..]), (0, now[strand].positions()));
    }
    stage.app.world_mut().despawn(observer);
}
