//! Finding the head of a character, and the meshes that make it up.

#[cfg(feature = "render")]
use super::old_hair::HiddenForHair;
use super::{
    error::WearError,
    head::{is_head, is_head_of_rigify},
    part::{Cue, MeshPart, MeshSkin, skin_of},
    skin::Hint,
    space::bound_to,
    what::WearHair,
};
use crate::{
    forces::contact::{ColliderShape, HairCollider},
    hair::strand::Hair,
};
use bevy::{
    asset::LoadState,
    ecs::system::SystemParam,
    math::Affine3A,
    mesh::{
        Mesh3d,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    platform::collections::HashSet,
    prelude::*,
};
use std::collections::VecDeque;

/// A collider that was fitted for worn hair.
#[derive(Component, Reflect, Clone, Copy, Debug)]
#[reflect(Component, Clone)]
pub(super) struct Fitted {
    #[entities]
    pub(super) wearer: Entity,
}

/// Where hair is to grow.
pub(super) struct Target {
    /// The bone or mesh that it is worn on.
    pub(super) head: Entity,
    pub(super) parts: Vec<MeshPart>,
    /// What is shown and moves with other bones than the head's, and not with its skin: capes, pauldrons.
    pub(super) garments: Vec<MeshPart>,
    /// What hangs on the head's bones without a skin and is called a hat, shown or not.
    pub(super) hats: Vec<MeshPart>,
    pub(super) own: OwnColliders,
    /// How the wearer is turned in the world, and how many metres one of its own is there.
    pub(super) turn: Quat,
    pub(super) size: f32,
}

/// Where a character has colliders that were not fitted for worn hair.
#[derive(Default)]
pub(super) struct OwnColliders {
    /// Entities that are or are above one.
    pub(super) above: HashSet<Entity>,
    /// The joints that they are on: the first at or above each.
    pub(super) joints: HashSet<Entity>,
    /// Hats, and what is above one below its joint.
    pub(super) hats: HashSet<Entity>,
    /// Those below the wearer.
    pub(super) solids: Vec<OwnSolid>,
}

/// A collider of a character's own.
pub(super) struct OwnSolid {
    pub(super) collider: HairCollider,
    /// The joint that it is on, and where it is there; in the wearer's space where it is on none.
    pub(super) joint: Option<Entity>,
    pub(super) place: Affine3A,
}

/// Result of the search for a head.
pub(super) enum Search {
    /// There is no mesh.
    Nothing,
    /// It is still loading.
    Loading,
    Found(Target),
    Failed(WearError),
}

impl From<Result<Target, WearError>> for Search {
    fn from(found: Result<Target, WearError>) -> Self {
        found.map_or_else(Self::Failed, Self::Found)
    }
}

/// The characters of the world.
#[derive(SystemParam)]
pub(super) struct Characters<'w, 's> {
    meshes: Option<Res<'w, Assets<Mesh>>>,
    poses: Option<Res<'w, Assets<SkinnedMeshInverseBindposes>>>,
    server: Option<Res<'w, AssetServer>>,
    nodes: Query<'w, 's, (Option<&'static Name>, Option<&'static Children>)>,
    skins: Query<'w, 's, (&'static Mesh3d, Option<&'static SkinnedMesh>)>,
    hairs: Query<'w, 's, (), With<Hair>>,
    wearers: Query<'w, 's, (), With<WearHair>>,
    colliders: Query<'w, 's, (Entity, &'static HairCollider), Without<Fitted>>,
    places: Query<'w, 's, (Option<&'static Transform>, Option<&'static ChildOf>)>,
    #[cfg(feature = "render")]
    shown: Query<'w, 's, (&'static Visibility, Has<HiddenForHair>)>,
}

impl Characters<'_, '_> {
    /// Finds the head for the hair of `wearer`. Heads of other wearers below it (a rider on a horse) count
    /// only if it has none of its own.
    pub(super) fn search(&self, wearer: Entity, wear: &WearHair) -> Search {
        let own = self.search_among(wearer, wear, &self.below(wearer, false));
        let is_missing = match &own {
            Search::Nothing => true,
            Search::Failed(error) => {
                matches!(error, WearError::NoBone { .. } | WearError::NoHead { .. })
            }
            Search::Loading | Search::Found(_) => false,
        };
        if !is_missing {
            return own;
        }
        match self.search_among(wearer, wear, &self.below(wearer, true)) {
            found @ (Search::Found(_) | Search::Loading) => found,
            Search::Nothing | Search::Failed(_) => own,
        }
    }

    fn search_among(&self, wearer: Entity, wear: &WearHair, all: &[Entity]) -> Search {
        let Some(meshes) = &self.meshes else { return Search::Nothing };
        let mut skinned = Vec::new();
        let mut reason = None;
        for &entity in all {
            let Ok((mesh, skin)) = self.skins.get(entity) else { continue };
            let poses = skin.map(|skin| skin.inverse_bindposes.id());
            let has_poses =
                poses.is_none_or(|id| self.poses.as_ref().is_some_and(|poses| poses.contains(id)));
            if meshes.contains(mesh.id()) && has_poses {
                skinned.push((entity, mesh, skin));
            } else if let Some(why) = self.failure(mesh.id().untyped()) {
                reason = Some(why);
            } else {
                return Search::Loading;
            }
        }
        match (skinned.is_empty(), reason) {
            (true, None) => Search::Nothing,
            (true, Some(reason)) => {
                Search::Failed(WearError::NotLoaded { what: "mesh of the character", reason })
            }
            _ => self.target(wearer, wear, all, &skinned).into(),
        }
    }

    /// Why an asset was not loaded, if it was not.
    pub(super) fn failure(&self, id: impl Into<bevy::asset::UntypedAssetId>) -> Option<String> {
        match self.server.as_ref()?.load_state(id) {
            LoadState::Failed(error) => {
                // The asset server has logged the full error.
                Some(error.to_string().lines().next().unwrap_or_default().to_owned())
            }
            _ => None,
        }
    }

    /// An entity and all its descendants, level by level, without hair and, unless `with_wearers`,
    /// without descendants of other wearers. A mesh on this one's skeleton is no other, whatever it wears itself.
    fn below(&self, top: Entity, with_wearers: bool) -> Vec<Entity> {
        let (mut found, mut todo) = (Vec::new(), VecDeque::from([top]));
        while let Some(entity) = todo.pop_front() {
            let is_other = !with_wearers
                && self.wearers.contains(entity)
                && !self.is_on_skeleton_of(entity, top);
            if entity != top && (is_other || self.hairs.contains(entity)) {
                continue;
            }
            found.push(entity);
            let children = self.nodes.get(entity).ok().and_then(|node| node.1);
            todo.extend(children.into_iter().flatten());
        }
        found
    }

    /// Whether an entity is a mesh that moves with bones which are below `top` and not below itself.
    fn is_on_skeleton_of(&self, mesh: Entity, top: Entity) -> bool {
        let Ok((_, Some(skin))) = self.skins.get(mesh) else { return false };
        let is_below = |of: Entity, top: Entity| {
            let parent = |of: &Entity| self.places.get(*of).ok()?.1.map(ChildOf::parent);
            core::iter::successors(Some(of), parent).any(|at| at == top)
        };
        skin.joints.first().is_some_and(|bone| is_below(*bone, top) && !is_below(*bone, mesh))
    }

    fn name(&self, entity: Entity) -> Option<&str> {
        self.nodes.get(entity).ok()?.0.map(Name::as_str)
    }

    fn target(
        &self,
        wearer: Entity,
        wear: &WearHair,
        all: &[Entity],
        skinned: &[(Entity, &Mesh3d, Option<&SkinnedMesh>)],
    ) -> Result<Target, WearError> {
        let joints: HashSet<Entity> =
            skinned.iter().filter_map(|s| s.2).flat_map(|s| s.joints.iter().copied()).collect();
        let head = match &wear.on {
            Some(name) => {
                let found = all.iter().find(|e| self.name(**e) == Some(name.as_str()));
                let missing =
                    || WearError::NoBone { name: name.clone(), there: self.names(all, &joints) };
                *found.ok_or_else(missing)?
            }
            None if self.skins.contains(wearer) => wearer,
            None => {
                let is_called = |e: &&Entity| self.name(**e).is_some_and(is_head);
                let joint = all.iter().filter(is_called).find(|e| joints.contains(*e));
                let is_last = |e: &&Entity| {
                    joints.contains(*e) && self.name(**e).is_some_and(is_head_of_rigify)
                };
                let any = joint
                    .or_else(|| all.iter().find(is_called))
                    .or_else(|| all.iter().find(is_last));
                let only = (skinned.len() == 1).then_some(&skinned[0].0);
                *any.or(only)
                    .ok_or_else(|| WearError::NoHead { there: self.names(all, &joints) })?
            }
        };
        let of_head: HashSet<Entity> = self.below(head, true).into_iter().collect();
        let moves = |skin: &SkinnedMesh| skin.joints.contains(&head);
        let mut chosen: Vec<_> = skinned.iter().filter(|s| s.2.is_some_and(moves)).collect();
        let is_bone = !chosen.is_empty();
        if !is_bone {
            chosen = skinned.iter().filter(|s| of_head.contains(&s.0)).collect();
        }
        if chosen.is_empty() {
            let name = self.name(head).unwrap_or("WearHair's entity").to_owned();
            return Err(WearError::NoSkin { name });
        }
        let is_named = |entity: Entity| match &wear.mesh {
            Some(name) => self.is_called(entity, name, &joints),
            None => true,
        };
        if let Some(name) = wear.mesh.as_ref().filter(|_| !chosen.iter().any(|s| is_named(s.0))) {
            let there: Vec<Entity> = chosen.iter().map(|s| s.0).collect();
            let there = self.names(&there, &HashSet::default());
            return Err(WearError::NoMeshNamed { name: name.clone(), there });
        }
        let part = |&&(entity, mesh, skin): &&(Entity, &Mesh3d, Option<&SkinnedMesh>)| {
            let skin = skin.and_then(|skin| {
                let poses = self.poses.as_ref()?.get(&skin.inverse_bindposes)?;
                Some(self.skin(skin, poses, is_bone.then_some((head, &of_head))))
            });
            let mesh_id = mesh.id();
            let mesh = self.meshes.as_ref().and_then(|meshes| meshes.get(mesh));
            let mesh = skin_of(mesh.ok_or(WearError::NoMesh)?)?;
            let to_wearer = match &skin {
                Some(skin) => self.bound(skin, wearer)?,
                None => self.relative(entity, wearer).ok_or(WearError::Pose)?,
            };
            Ok(MeshPart {
                entity,
                name: self.name_of_mesh(entity, &joints),
                is_shown: self.is_shown(entity, wearer),
                is_named: is_named(entity),
                mesh,
                mesh_id,
                skin,
                to_wearer,
            })
        };
        let parts: Vec<MeshPart> = chosen.iter().map(part).collect::<Result<_, WearError>>()?;
        let is_other = |s: &&(Entity, &Mesh3d, Option<&SkinnedMesh>)| {
            is_bone && !chosen.iter().any(|part| part.0 == s.0) && !of_head.contains(&s.0)
        };
        let garments = skinned.iter().filter(is_other).filter_map(|s| {
            let part = match s.2 {
                Some(_) => part(&s).ok()?,
                None => self.rigid(s, wearer, &joints, &parts)?,
            };
            part.is_shown.then_some(part)
        });
        let garments = garments.collect();
        let hangs = |s: &&(Entity, &Mesh3d, Option<&SkinnedMesh>)| {
            is_bone && s.2.is_none() && of_head.contains(&s.0)
        };
        let hanging = skinned.iter().filter(hangs);
        let hanging = hanging.filter_map(|s| self.rigid(s, wearer, &joints, &parts));
        let own = self.own_colliders(wearer, &joints);
        let is_own = |mesh: Entity| {
            let mut below = self.upward(mesh).take_while(|at| !joints.contains(at));
            below.any(|at| own.hats.contains(&at))
        };
        let hats = hanging.filter(|part| Hint::of(&part.name) == Hint::Worn);
        let hats = hats.filter(|part| !is_own(part.entity));
        let hats = hats.map(|part| MeshPart { skin: None, ..part }).collect();
        let (turn, size) = self.stands(wearer);
        Ok(Target { head, garments, hats, parts, own, turn, size })
    }

    /// How an entity is turned in the world, and how large it is.
    fn stands(&self, entity: Entity) -> (Quat, f32) {
        let place = |at: Entity| self.places.get(at).ok()?.0.map(Transform::compute_affine);
        let world = self.upward(entity).filter_map(place);
        let world = world.fold(Affine3A::IDENTITY, |below, at| at * below);
        let (scale, turn, _) = world.to_scale_rotation_translation();
        let size = scale.element_product().abs().cbrt();
        let is_sound = turn.is_finite() && size.is_finite() && size > 0.0;
        if is_sound { (turn, size) } else { (Quat::IDENTITY, 1.0) }
    }

    /// A mesh without a skin that hangs on a bone of the body, as moved by that bone alone; `None` on none, and for
    /// what hands hold.
    fn rigid(
        &self,
        &(entity, mesh, _): &(Entity, &Mesh3d, Option<&SkinnedMesh>),
        wearer: Entity,
        joints: &HashSet<Entity>,
        parts: &[MeshPart],
    ) -> Option<MeshPart> {
        let joint = self.upward(entity).find(|above| joints.contains(above))?;
        let mut above = self.upward(joint).take_while(|above| *above != wearer);
        let is_hand =
            |at: Entity| self.name(at).is_some_and(|name| Cue::of(name, false) == Cue::Hand);
        if above.any(is_hand) {
            return None;
        }
        let pose = self.relative(entity, wearer)?;
        let pose = self.relative(joint, wearer)?.inverse() * pose;
        // Where the body is bound, the joint may be elsewhere than now.
        let bound = parts.iter().find_map(|part| {
            let skin = part.skin.as_ref()?;
            let at = skin.joints.iter().position(|other| *other == joint)?;
            Some(part.to_wearer * skin.poses.get(at)?.inverse())
        });
        let to_wearer = bound? * pose;
        let mesh_id = mesh.id();
        let mesh = skin_of(self.meshes.as_ref()?.get(mesh)?).ok()?;
        let skin = MeshSkin {
            joints: vec![joint],
            poses: vec![pose],
            head: None,
            of_head: vec![false],
            cues: vec![Cue::None],
        };
        (to_wearer.is_finite() && pose.inverse().is_finite()).then(|| MeshPart {
            entity,
            name: self.name_of_mesh(entity, joints),
            is_shown: self.is_shown(entity, wearer),
            is_named: false,
            mesh,
            mesh_id,
            skin: Some(skin),
            to_wearer,
        })
    }

    /// Whether a mesh, or the node that it is a part of, has this name.
    fn is_called(&self, mesh: Entity, name: &str, joints: &HashSet<Entity>) -> bool {
        self.name(mesh) == Some(name) || self.node_of(mesh, joints) == Some(name)
    }

    /// The name of the node above a mesh, which is not a joint.
    fn node_of(&self, mesh: Entity, joints: &HashSet<Entity>) -> Option<&str> {
        let above = self.upward(mesh).nth(1).filter(|above| !joints.contains(above))?;
        self.name(above)
    }

    /// The name of a mesh with that of its node.
    fn name_of_mesh(&self, mesh: Entity, joints: &HashSet<Entity>) -> String {
        let names = [self.node_of(mesh, joints), self.name(mesh)];
        names.into_iter().flatten().collect::<Vec<_>>().join("/")
    }

    /// Whether a mesh is drawn, as far as that is decided below the wearer. What is hidden for worn hair counts as
    /// shown.
    #[cfg(feature = "render")]
    pub(super) fn is_shown(&self, mesh: Entity, wearer: Entity) -> bool {
        let below = self.upward(mesh).take_while(|at| *at != wearer);
        let each = below.filter_map(|at| self.shown.get(at).ok());
        let decided = each.map(|(is, for_hair)| match is {
            Visibility::Hidden if !for_hair => Some(false),
            Visibility::Visible => Some(true),
            _ => None,
        });
        decided.flatten().next().unwrap_or(true)
    }

    #[cfg(not(feature = "render"))]
    pub(super) fn is_shown(&self, _: Entity, _: Entity) -> bool {
        true
    }

    /// Where the character's own colliders are. Those of other wearers, and what games put on hair, are not its own. A hat
    /// is in the place of none.
    fn own_colliders(&self, wearer: Entity, joints: &HashSet<Entity>) -> OwnColliders {
        let mut own = OwnColliders::default();
        for (at, collider) in &self.colliders {
            let (mut joint, mut is_below) = (None, false);
            let is_hat = matches!(collider.shape, ColliderShape::Hat { .. });
            for entity in self.upward(at) {
                if !is_hat {
                    own.above.insert(entity);
                }
                joint = joint.or_else(|| joints.get(&entity).copied());
                if is_hat && joint.is_none() {
                    own.hats.insert(entity);
                }
                is_below |= entity == wearer;
                let is_other = entity != wearer && self.wearers.contains(entity);
                if is_other || self.hairs.contains(entity) {
                    break;
                }
            }
            own.joints.extend(joint.filter(|_| !is_hat));
            if let Some(place) = self.relative(at, joint.unwrap_or(wearer)).filter(|_| is_below) {
                own.solids.push(OwnSolid { collider: collider.clone(), joint, place });
            }
        }
        own
    }

    /// An entity and all above it.
    fn upward(&self, entity: Entity) -> impl Iterator<Item = Entity> + '_ {
        core::iter::successors(Some(entity), move |e| {
            self.places.get(*e).ok()?.1.map(ChildOf::parent)
        })
    }

    fn skin(
        &self,
        skin: &SkinnedMesh,
        poses: &[Mat4],
        bone: Option<(Entity, &HashSet<Entity>)>,
    ) -> MeshSkin {
        let position = |is_name: fn(&str) -> bool| {
            skin.joints.iter().position(|j| self.name(*j).is_some_and(is_name))
        };
        let called = || position(is_head).or_else(|| position(is_head_of_rigify));
        let head = match bone {
            Some((head, _)) => skin.joints.iter().position(|joint| *joint == head),
            None => called(),
        };
        // Eyes, jaw and the like belong to the head.
        let below: HashSet<Entity> = match (bone, head) {
            (Some((_, below)), _) => below.clone(),
            (None, Some(head)) => self.below(skin.joints[head], true).into_iter().collect(),
            (None, None) => default(),
        };
        let of_head: Vec<bool> = skin.joints.iter().map(|joint| below.contains(joint)).collect();
        let cue = |(joint, of_head): (&Entity, &bool)| {
            self.name(*joint).map_or(Cue::None, |name| Cue::of(name, *of_head))
        };
        let cues = skin.joints.iter().zip(&of_head).map(cue).collect();
        let poses = poses.iter().map(|pose| Affine3A::from_mat4(*pose)).collect();
        MeshSkin { joints: skin.joints.clone(), poses, head, of_head, cues }
    }

    /// From a skinned mesh, as it is bound, to the wearer, by the joint that is nearest to the root.
    fn bound(&self, skin: &MeshSkin, wearer: Entity) -> Result<Affine3A, WearError> {
        let (joints, poses) = (skin.joints.len(), skin.poses.len());
        let root = (0..joints.min(poses)).min_by_key(|i| self.upward(skin.joints[*i]).count());
        let root = root.ok_or(WearError::Joints { joints, poses, found: 0 })?;
        let now = self.relative(skin.joints[root], wearer).ok_or(WearError::Pose)?;
        bound_to(now, skin.poses[root]).ok_or(WearError::Pose)
    }

    /// From an entity's space to the wearer's.
    fn relative(&self, entity: Entity, wearer: Entity) -> Option<Affine3A> {
        let own = |e: Entity| {
            let place = self.places.get(e).ok()?.0;
            Some(place.map_or(Affine3A::IDENTITY, Transform::compute_affine))
        };
        let parent = |e: Entity| self.places.get(e).ok()?.1.map(ChildOf::parent);
        let chain = |e: Entity| {
            let (mut at, mut sum) = (Some(e), Affine3A::IDENTITY);
            while let Some(e) = at.filter(|e| *e != wearer) {
                sum = own(e)? * sum;
                at = parent(e);
            }
            Some((at.is_some(), sum))
        };
        let (is_below, transform) = chain(entity)?;
        if is_below {
            return transform.is_finite().then_some(transform);
        }
        // A skeleton that is not above its mesh: through world space.
        let (_, above) = parent(wearer).map_or(Some((false, Affine3A::IDENTITY)), chain)?;
        let transform = (above * own(wearer)?).inverse() * transform;
        transform.is_finite().then_some(transform)
    }

    /// The names of the joints, or of all where there are none: the first forty.
    fn names(&self, all: &[Entity], joints: &HashSet<Entity>) -> String {
        const MAX_NAMES: usize = 40;
        let is_listed = |e: &&Entity| joints.is_empty() || joints.contains(*e);
        let names: Vec<&str> = all.iter().filter(is_listed).filter_map(|e| self.name(*e)).collect();
        let more = names.len().saturating_sub(MAX_NAMES);
        let shown =
            names.iter().take(MAX_NAMES).map(|name| format!("{name:?}")).collect::<Vec<_>>();
        match (shown.is_empty(), more) {
            (true, _) => "no names at all".into(),
            (_, 0) => shown.join(", "),
            _ => format!("{} and {more} more", shown.join(", ")),
        }
    }
}
