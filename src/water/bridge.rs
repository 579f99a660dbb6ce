//! `Interaction`: bridges of water pull wet strands together and damp their relative motion.

use super::{
    HairWetting, Moisture, droplet_contact::WaterField, exchange::FoundWater,
    moisture::node_lengths,
};
use crate::{
    base::{schedule::EffectiveSubsteps, setting::Settings},
    forces::contact::{Bridged, Film, LockNeighbours, StrandContact},
    hair::{
        strand::{AddedMass, Hair, HairHere, MotionOwner, Strand, StrandOf, StrandSleep, Strands},
        worn::WornBy,
    },
};
use bevy::prelude::*;

/// Whether any strand of a hair has a film. Updated once a tick.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct IsWet(pub(crate) bool);

/// Whether any strand of a hair holds water beyond the regain at room humidity. Updated once a tick.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct HoldsWater(pub(crate) bool);

/// Triggered on a wet [`Hair`] when it has dried to the regain at room humidity, then on its wearer
/// ([`WornBy`]). An observer of the whole app sees both; `On::original_event_target` is the hair.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn watch(In(character): In<Entity>, mut commands: Commands) {
///     commands.entity(character).observe(|dried: On<HairDried>| info!("{} is dry", dried.entity));
/// }
/// ```
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[entity_event(propagate = &'static WornBy, auto_propagate)]
#[reflect(Clone, PartialEq)]
pub struct HairDried {
    /// The hair, or its wearer.
    pub entity: Entity,
}

pub(super) fn update_is_wet(
    found: Res<FoundWater>,
    mut hairs: Query<(Entity, &Strands, &mut IsWet, &mut HoldsWater), HairHere>,
    strands: Query<&Moisture>,
    mut commands: Commands,
) {
    for (entity, members, mut is_wet, mut holds) in &mut hairs {
        let members = || strands.iter_many(members.collection());
        let holds_water = found.any && members().any(|moisture| !moisture.is_untouched());
        if holds.0 && !holds_water {
            commands.trigger(HairDried { entity });
        }
        holds.set_if_neq(HoldsWater(holds_water));
        is_wet.set_if_neq(IsWet(found.busy && members().any(Moisture::has_film)));
    }
}

/// How long bridges of water between the strands of a hair may get; `None` where there are none.
fn bridges_of(contact: StrandContact, wetting: &HairWetting, wet: &IsWet) -> Option<Film> {
    let joins = contact.radius > 0.0
        && contact.strength > 0.0
        && (wetting.cohesion > 0.0 || wetting.film_drag > 0.0)
        && wet.0;
    joins.then(|| Film::between(2.0 * contact.radius))
}

/// Once a tick, before contact: the lists of wet hair hold all that bridges of water may join.
pub(super) fn widen_contact(
    contact: Settings<StrandContact>,
    wetting: Settings<HairWetting>,
    mut hairs: Query<(Entity, &IsWet, &mut LockNeighbours), With<Hair>>,
) {
    for (hair, wet, mut neighbours) in &mut hairs {
        let film = bridges_of(contact.of(hair), &wetting.of(hair), wet);
        let longest = film.map_or(0.0, |film| film.longest);
        neighbours.bypass_change_detection().set_extra_margin(longest);
    }
}

/// Bridges of water between the wet strands of each hair, found by its contact lists.
pub(super) fn join_wet_strands(
    steps: EffectiveSubsteps,
    contact: Settings<StrandContact>,
    wetting: Settings<HairWetting>,
    mut scratch: ResMut<WaterField>,
    mut hairs: Query<(Entity, &Strands, &IsWet, &mut LockNeighbours, &MotionOwner), With<Hair>>,
    mut strands: Query<(&mut Strand, &Moisture, &AddedMass, &StrandSleep), With<StrandOf>>,
) {
    let rows = &mut scratch.bypass_change_detection().rows;
    for (hair, members, wet, mut neighbours, owner) in &mut hairs {
        let wetting = wetting.of(hair);
        let Some(film) = bridges_of(contact.of(hair), &wetting, wet) else { continue };
        if owner.sleeps() {
            continue;
        }
        let Some(substep) = steps.of(hair) else { continue };
        let list = neighbours.bypass_change_detection();
        rows.clear();
        for (strand, moisture, ..) in strands.iter_many(members.collection()) {
            let film = |i: usize| moisture.film().get(i).copied().unwrap_or(0.0);
            let lengths = node_lengths(strand.rest_lengths());
            rows.extend(strand.velocities().iter().zip(lengths).enumerate().map(
                |(i, (v, length))| [v.x, v.y, v.z, (film(i) / f64::from(length.max(1e-9))) as f32],
            ));
        }
        // Contact may not have run since strands were added or removed.
        if list.nodes() != rows.len() {
            continue;
        }
        let mut bridges = list.bridges(rows, film, substep.is_first);
        let mut members = strands.iter_many_mut(members.collection());
        while let Some((mut strand, _, added_mass, sleep)) = members.fetch_next() {
            let nodes = strand.nodes();
            if sleep.is_asleep() {
                bridges.by_ref().take(nodes).for_each(drop);
                continue;
            }
            let (_, velocities, ..) = strand.bypass_change_detection().parts_mut();
            for (i, (v, bridged)) in velocities.iter_mut().zip(&mut bridges).enumerate() {
                let load = added_mass.mass.get(i).copied().unwrap_or(0.0);
                *v = joined(*v, &bridged, &wetting, load, substep.dt);
            }
        }
    }
}

/// The velocity of a node with added mass `load` (in dry masses) after a substep of `dt` (s) with its
/// bridges.
///
/// The pull is explicit and limited to what the substep can follow; the film's drag relaxes to the
/// common velocity by the exact solution, stable at any strength.
fn joined(v: Vec3, bridged: &Bridged, wetting: &HairWetting, load: f32, dt: f32) -> Vec3 {
    if bridged.strength <= 0.0 {
        return v;
    }
    let pull = wetting.cohesion * dt;
    let follows = (1.0 + load) / (pull * dt * bridged.steepness).max(1e-9);
    let pulled = v + bridged.pull * (pull * follows.min(1.0) / (1.0 + load));
    let shared =
        1.0 - bevy::math::ops::exp(-wetting.film_drag * dt * bridged.strength / (1.0 + load));
    pulled.lerp(bridged.drift / bridged.strength, shared)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bridge_pulls_up_to_the_stable_limit_and_shares_motion() {
        let bridged =
            Bridged { pull: Vec3::X, steepness: 1e3, drift: Vec3::Y * 2.0, strength: 2.0 };
        let wetting = HairWetting { cohesion: 10.0, film_drag: 0.0, ..default() };
        let dt = 1.0 / 360.0;
        let v = joined(Vec3::ZERO, &bridged, &wetting, 0.0, dt);
        assert!(v.distance(Vec3::X * 10.0 * dt) < 1e-7, "{v}");
        let heavy = joined(Vec3::ZERO, &bridged, &wetting, 1.0, dt);
        assert!(heavy.distance(0.5 * v) < 1e-7, "{heavy}");
        // Twice over the limit: the pull is halved.
        let steep = Bridged { steepness: 2.0 / (10.0 * dt * dt), ..bridged };
        let v = joined(Vec3::ZERO, &steep, &wetting, 0.0, dt);
        assert!(v.distance(Vec3::X * 5.0 * dt) < 1e-6, "{v}");
        // The common velocity is drift over strength: the limit of infinite drag.
        let wetting = HairWetting { cohesion: 0.0, film_drag: 1e9, ..default() };
        assert!(joined(Vec3::X, &bridged, &wetting, 0.0, dt).distance(Vec3::Y) < 1e-6);
        let wetting = HairWetting { cohesion: 0.0, film_drag: 30.0, ..default() };
        let v = joined(Vec3::X, &bridged, &wetting, 0.0, dt);
        let left = (-60.0 * dt).exp();
        assert!(v.distance(Vec3::X * left + Vec3::Y * (1.0 - left)) < 1e-6);
    }
}
