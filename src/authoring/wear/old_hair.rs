//! Hair that a character came with is hidden while ours is worn.

use bevy::prelude::*;

/// A mesh that is hidden because hair is worn in its place.
#[derive(Component, Reflect, Clone, Copy, Debug)]
#[reflect(Component, Clone)]
pub(super) struct HiddenForHair {
    #[entities]
    pub(super) wearer: Entity,
    /// Its visibility before.
    before: Visibility,
}

/// Hides meshes for the hair of a wearer.
pub(super) fn hide(commands: &mut Commands, wearer: Entity, meshes: &[Entity]) {
    for mesh in meshes {
        commands.entity(*mesh).queue_silenced(move |mut mesh: EntityWorldMut| {
            let before = mesh.get::<Visibility>().copied().unwrap_or_default();
            if before != Visibility::Hidden {
                mesh.insert((Visibility::Hidden, HiddenForHair { wearer, before }));
            }
        });
    }
}

/// Shows what was hidden for the hair of a wearer, unless the game has shown it already.
pub(super) fn show(commands: &mut Commands, wearer: Entity) {
    commands.queue(move |world: &mut World| {
        let mut hidden = world.query::<(Entity, &HiddenForHair)>();
        let own = hidden.iter(world).filter(|(_, hidden)| hidden.wearer == wearer);
        let own: Vec<_> = own.map(|(mesh, hidden)| (mesh, hidden.before)).collect();
        for (mesh, before) in own {
            let mut mesh = world.entity_mut(mesh);
            mesh.remove::<HiddenForHair>();
            if mesh.get::<Visibility>() == Some(&Visibility::Hidden) {
                mesh.insert(before);
            }
        }
    });
}
