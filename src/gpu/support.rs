//! What keeps a hair on the CPU: everything that acts on it and is not in the kernels.

use super::{
    record::{self, MAX_BLOWERS},
    residence::Unsupported,
    treatments::GpuTreatments,
};
#[cfg(feature = "groom")]
use crate::authoring::attach::{RootsOnBones, RootsOnMesh, TiedRoots};
use crate::{
    base::setting::Settings,
    forces::{
        contact::{Obstacles, StrandContact},
        environment::{WindReceived, Winds},
    },
    hair::strand::{
        Hair, HeldNodes, HeldNodesState, OnGpu, PlayedHair, RecordedHair, Strand, StrandModel,
        StrandOf, Strands, TickPose,
    },
    hairdo::{
        style::HairStyle,
        tie::{TieProgress, Tied},
    },
    keratin::treatment::{PermRod, PermWinding, WindingProgress, WoundOn},
    simulation::{
        lod::{Guides, PresentLod},
        settle::Settling,
    },
    solver::rod::{HairSolver, SolverMethod, StrandMaterial},
    water::{Droplet, IsWet, Shower, WaterVolume},
};
use bevy::{
    ecs::{entity::EntityHashMap, entity_disabling::Disabled, system::SystemParam},
    prelude::*,
};

#[derive(SystemParam)]
pub(super) struct Support<'w, 's> {
    model: Settings<'w, 's, StrandModel>,
    solver: Settings<'w, 's, HairSolver>,
    contact: Settings<'w, 's, StrandContact>,
    winds: Winds<'w, 's>,
    water: Query<'w, 's, (), Or<(With<WaterVolume>, With<Droplet>, With<Shower>)>>,
    hairs: Query<
        'w,
        's,
        (
            &'static TickPose,
            Option<&'static Obstacles>,
            Option<&'static IsWet>,
            Option<(&'static PresentLod, &'static Guides)>,
            Has<Settling>,
            Has<HairStyle>,
            Option<&'static GpuTreatments>,
            Option<&'static Strands>,
        ),
        With<Hair>,
    >,
    held: Query<
        'w,
        's,
        (Entity, &'static StrandOf, &'static HeldNodes, Option<&'static HeldNodesState>),
    >,
    wound: Query<
        'w,
        's,
        (
            &'static StrandOf,
            &'static Strand,
            &'static WoundOn,
            &'static PermWinding,
            &'static WindingProgress,
        ),
    >,
    tied: Query<'w, 's, (&'static StrandOf, &'static TieProgress), With<Tied>>,
    rods: Query<'w, 's, (), With<PermRod>>,
    counted: Query<'w, 's, &'static StrandOf, With<WindReceived>>,
    materials: Query<'w, 's, (&'static StrandOf, &'static StrandMaterial)>,
    cached: Query<'w, 's, (), Or<(With<PlayedHair>, With<RecordedHair>)>>,
    disabled: Query<'w, 's, &'static StrandOf, (With<OnGpu>, With<Disabled>)>,
    #[cfg(feature = "groom")]
    on_mesh: Query<'w, 's, (Ref<'static, RootsOnMesh>, &'static TiedRoots)>,
    #[cfg(feature = "groom")]
    on_bones: Query<'w, 's, (Ref<'static, RootsOnBones>, &'static TiedRoots)>,
}

impl Support<'_, '_> {
    /// Reasons of single strands, by hair.
    pub(super) fn of_strands(&self) -> EntityHashMap<Unsupported> {
        let mut found = EntityHashMap::default();
        let held = self.held.iter().filter(|(.., held, state)| {
            matches!(held.targets.first(), Some(Some(_)))
                || held.frames.iter().any(Option::is_some)
                || state.is_some_and(HeldNodesState::gives_way)
        });
        found.extend(held.map(|(_, of, ..)| (of.0, Unsupported::HeldNodes)));
        let begins = self.wound.iter().filter(|(_, strand, on, settings, wound)| {
            self.rods.contains(on.0) && wound.waits(strand, settings)
        });
        found.extend(begins.map(|(of, ..)| (of.0, Unsupported::Winding)));
        let begins = self.tied.iter().filter(|(_, tie)| tie.waits());
        found.extend(begins.map(|(of, _)| (of.0, Unsupported::Winding)));
        found.extend(self.counted.iter().map(|of| (of.0, Unsupported::WindReceived)));
        let own = self.materials.iter().filter(|(_, own)| **own != StrandMaterial::default());
        found.extend(own.map(|(of, _)| (of.0, Unsupported::StrandMaterial)));
        found.extend(self.disabled.iter().map(|of| (of.0, Unsupported::Strands)));
        found
    }

    /// The strands of hair with followers that have held nodes, in order; `None` of hair without followers.
    pub(super) fn held_strands(&self, hair: Entity) -> Option<Vec<Entity>> {
        let (.., lod, _, _, _, _) = self.hairs.get(hair).ok()?;
        lod.filter(|(lod, _)| lod.followers > 0)?;
        let held = self
            .held
            .iter()
            .filter(|(_, of, held, _)| of.0 == hair && held.targets.iter().any(Option::is_some));
        let mut held: Vec<Entity> = held.map(|(strand, ..)| strand).collect();
        held.sort_unstable();
        Some(held)
    }

    /// Whether a hair that only its level of detail keeps would go without the
    /// [`HairBudget`](crate::HairBudget).
    pub(super) fn wants_simulation(&self, hair: Entity) -> bool {
        let Ok((.., lod, _, _, _, _)) = self.hairs.get(hair) else { return false };
        lod.is_some_and(|(lod, _)| lod.wants_simulation())
    }

    /// What solves a hair's rods.
    pub(super) fn method(&self, hair: Entity) -> SolverMethod {
        self.solver.of(hair).method
    }

    /// The first reason of a hair.
    pub(super) fn missing(&self, hair: Entity) -> Option<Unsupported> {
        let (frame, obstacles, wet, lod, settles, is_watched, treatments, members) =
            self.hairs.get(hair).ok()?;
        let contact = self.contact.of(hair);
        let air = self.winds.seen_from(frame);
        // Of the tick before: what is near is looked at before it touches.
        let unplaced = obstacles.and_then(|all| record::unsupported(&all.solids));
        #[cfg(feature = "groom")]
        let is_being_tied = (self.on_mesh.get(hair))
            .is_ok_and(|(roots, tied)| roots.is_changed() || roots.mesh.is_some() && tied.wait())
            || (self.on_bones.get(hair))
                .is_ok_and(|(roots, tied)| roots.is_changed() || tied.wait());
        #[cfg(not(feature = "groom"))]
        let is_being_tied = false;
        let reasons = [
            (members.is_none_or(|members| members.is_empty()), Unsupported::Strands),
            (self.model.of(hair) == StrandModel::MassSpring, Unsupported::Springs),
            (contact.radius > 0.0 && contact.strength > 0.0, Unsupported::StrandContact),
            (wet.is_some_and(|wet| wet.0) || !self.water.is_empty(), Unsupported::Water),
            (air.steady_wind().is_none(), Unsupported::UnsteadyWind),
            (air.blowers.len() > MAX_BLOWERS, Unsupported::Blowers),
            (unplaced == Some(Unsupported::Colliders), Unsupported::Colliders),
            (unplaced.is_some(), Unsupported::ColliderShape),
            (is_being_tied, Unsupported::MovingRoots),
            (settles, Unsupported::Settling),
            (self.cached.contains(hair), Unsupported::GroomCache),
            (is_watched, Unsupported::WatchedStyle),
            (treatments.is_some_and(GpuTreatments::are_too_many), Unsupported::Treatments),
            // The last: where nothing else is missing the budget lets go of it.
            (
                lod.is_some_and(|(lod, guides)| {
                    let count = members.map_or(0, |members| members.len());
                    lod.simulated_share() <= 0.0
                        || lod.budget_levels > 0
                        || !guides.suit(lod, count)
                }),
                Unsupported::LevelOfDetail,
            ),
        ];
        reasons.into_iter().find(|(is_there, _)| *is_there).map(|(_, what)| what)
    }
}
