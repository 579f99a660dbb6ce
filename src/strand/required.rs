//! Components without which a strand, a hair or a tool would be left out of the tick unnoticed.

use crate::fault::{FaultKind, HairChecks, HairFault};
use bevy::{prelude::*, utils::prelude::ShortName};

/// Puts `Part` back on each `Owner` that user code took it off, and reports it.
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
            "`{part}` was removed, which `{owner}` needs: its default is put back; to leave the entity out, \
             insert `Disabled`"
        );
        faults.write(HairFault::new(FaultKind::Component, message).of(entity));
    }
}
