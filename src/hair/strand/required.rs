//! Components without which the tick would silently skip a strand, a hair or a tool.

use crate::base::fault::{FaultKind, HairChecks, HairFault};
use bevy::{prelude::*, utils::prelude::ShortName};

/// Restores `Part` on each `Owner` from which user code removed it, and reports it.
pub(crate) fn keep_required<Owner: Component, Part: Component + Default>(app: &mut App) {
    app.add_systems(HairChecks, put_back::<Owner, Part>);
}

fn put_back<Owner: Component, Part: Component + Default>(
    lacking: Query<Entity, (With<Owner>, Without<Part>)>,
    mut commands: Commands,
    mut faults: MessageWriter<HairFault>,
) {
    for entity in &lacking {
        commands.entity(entity).try_insert(Part::default());
        let (part, owner) = (ShortName::of::<Part>(), ShortName::of::<Owner>());
        let message = format!(
            "`{part}` was removed, which `{owner}` needs: its default is put back; to exclude the entity, \
         insert `Disabled`"
        );
        faults.write(HairFault::new(FaultKind::Component, message).of(entity));
    }
}
