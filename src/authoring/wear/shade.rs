//! Worn hair shades the skin under it: without that, partings and hairlines are bare bands of the skin's colour.

use super::{
    part::skin_of,
    shell::{MadeOf, Shell, Skin, drawn, shells},
    what::WornAs,
};
use crate::{
    authoring::attach::RootsOnMesh,
    base::{
        schedule::HairFrame,
        setting::{HairDefault, Settings, setting},
    },
    hair::{
        look::{HairColor, HairDye, HairLook},
        strand::MotionOwner,
        worn::{self, ActsOn, CopyOf, pass_on},
    },
    render::FollowerRoots,
};
use bevy::{
    asset::AssetEventSystems,
    camera::visibility::{RenderLayers, VisibilitySystems},
    light::NotShadowCaster,
    mesh::{morph::MeshMorphWeights, skinning::SkinnedMesh},
    platform::collections::HashSet,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};

setting! {
    /// How hair that is worn ([`WearHair`](super::WearHair)) shades the skin under it. Component of the
    /// [`Hair`](crate::Hair), may change at any time; where absent, [`HairDefault<ScalpShade>`](crate::HairDefault)
    /// holds.
    ///
    /// The skin under hair is darker and has the hair's colour. Bare, it would shine through at partings and
    /// hairlines. So a thin shell of the skin's own triangles is drawn over it, as opaque as strands grow densely
    /// there, in half of the colour that hair has at its roots, dye included. It is a child of the hair with a mesh
    /// and a `StandardMaterial` of its own, named `scalp shade`, follows skinning and morph targets, and goes with the
    /// hair; the game's mesh and material stay as they are. Skin without normals is not shaded.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut app = App::new();
    /// // A game that paints its scalps itself:
    /// app.insert_resource(HairDefault(ScalpShade { strength: 0.0 }));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct ScalpShade {
        /// Share of the skin's own colour that is hidden where hair is dense; 0 is no shade.
        pub strength: f32 = 0.85, in STRENGTH: 0.0..=1.0, "0.85 is a full head of hair";
    }
}

/// Share of the hair's colour that what lies between its roots has: little light comes there.
const BETWEEN: f32 = 0.5;

/// What is done for a hair.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
pub(super) enum Shading {
    Making(Task<Vec<Shell>>),
    Made(Vec<Shell>),
    Shown(Handle<StandardMaterial>),
}

/// Marks the child of a hair that shades one of its skins.
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Clone)]
struct ScalpShell {
    #[entities]
    skin: Entity,
    made_of: MadeOf,
}

/// The shells of a hair: its own render layers replace those of the skin.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
struct ScalpShells(Vec<Entity>);

impl ActsOn for ScalpShells {
    fn others(&self) -> &[Entity] {
        &self.0
    }
}

/// What shades skin, once hair has been put on.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct ShadeSystems;

pub(super) fn plugin(app: &mut App) {
    worn::setting::<ScalpShade>(app);
    app.register_type::<ScalpShell>()
        .register_type::<CopyOf<RenderLayers>>()
        .add_systems(
            HairFrame,
            (begin, show, tint)
                .chain()
                .in_set(ShadeSystems)
                .run_if(resource_exists::<Assets<StandardMaterial>>)
                .run_if(resource_exists::<Assets<Mesh>>),
        )
        .add_systems(
            PostUpdate,
            pass_on::<RenderLayers, ScalpShells>.before(VisibilitySystems::CheckVisibility),
        )
        .add_systems(
            PostUpdate,
            follow
                .after(AssetEventSystems)
                .after(TransformSystems::Propagate)
                .run_if(any_with_component::<ScalpShell>),
        );
}

/// Whether hair that a wearer puts on shades its skin from the beginning.
pub(super) fn shades(world: &World, wearer: Entity) -> bool {
    let all = world.get_resource::<HairDefault<ScalpShade>>().map(|all| &all.0);
    let strength = world.get::<ScalpShade>(wearer).or(all).map_or(0.0, |shade| shade.strength);
    world.contains_resource::<Assets<StandardMaterial>>() && strength > 0.0
}

/// Starts to make shells for hair that has none, and removes them where none are wanted.
fn begin(
    mut commands: Commands,
    hairs: Query<
        (Entity, Ref<RootsOnMesh>, Option<Ref<FollowerRoots>>, Option<&Shading>),
        With<WornAs>,
    >,
    settings: Settings<ScalpShade>,
    (skins, meshes): (Query<&Mesh3d>, Res<Assets<Mesh>>),
    shown: Query<(Entity, &ChildOf), With<ScalpShell>>,
) {
    for (hair, roots, followers, shading) in &hairs {
        let is_wanted = settings.of(hair).strength > 0.0;
        if let Some(shading) = shading {
            let is_written = roots.is_changed() && !roots.is_added();
            let is_other = is_written || followers.is_some_and(|f| f.is_changed() && !f.is_added());
            if !is_wanted || is_other && !matches!(shading, Shading::Making(_)) {
                commands.entity(hair).remove::<Shading>();
            }
            if !is_wanted {
                remove_shells(&mut commands, hair, &shown);
            }
            continue;
        }
        if !is_wanted {
            continue;
        }
        let meshes = roots.meshes().map(|(entity, to_hair)| {
            let mesh = meshes.get(&skins.get(entity).ok()?.0)?;
            Some(skin_of(mesh).map(|mesh| Skin { entity, mesh, to_hair }))
        });
        // Some are still loading.
        let Some(meshes) = meshes.collect::<Option<Vec<_>>>() else { continue };
        let skins: Vec<Skin> = meshes.into_iter().filter_map(Result::ok).collect();
        let none = FollowerRoots::default();
        let drawn = drawn(followers.as_deref().unwrap_or(&none), &roots.roots, &skins);
        let shading = match AsyncComputeTaskPool::try_get() {
            Some(pool) => Shading::Making(pool.spawn(async move { shells(&skins, &drawn) })),
            None => Shading::Made(shells(&skins, &drawn)),
        };
        commands.entity(hair).insert(shading);
    }
}

fn remove_shells(
    commands: &mut Commands,
    hair: Entity,
    shown: &Query<(Entity, &ChildOf), With<ScalpShell>>,
) {
    for (shell, _) in shown.iter().filter(|(_, of)| of.parent() == hair) {
        commands.entity(shell).try_despawn();
    }
}

/// Shows shells that are made, once their hair has settled.
fn show(
    mut commands: Commands,
    mut hairs: Query<(Entity, &mut Shading, &MotionOwner)>,
    skins: Query<(&Mesh3d, Option<&SkinnedMesh>, Option<&MeshMorphWeights>, Option<&RenderLayers>)>,
    shown: Query<(Entity, &ChildOf), With<ScalpShell>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for (hair, mut shading, owner) in &mut hairs {
        if let Shading::Making(task) = &mut *shading
            && let Some(made) = check_ready(task)
        {
            *shading = Shading::Made(made);
        }
        let Shading::Made(shells) = &mut *shading else { continue };
        if *owner == MotionOwner::Settling {
            continue;
        }
        let shells = core::mem::take(shells);
        let material = materials.add(StandardMaterial {
            alpha_mode: AlphaMode::Blend,
            perceptual_roughness: 1.0,
            reflectance: 0.1,
            // Mirrored wearers show their backs.
            cull_mode: None,
            ..default()
        });
        // Also those that were copied, or loaded, with the hair.
        remove_shells(&mut commands, hair, &shown);
        let mut all = Vec::new();
        for mut shell in shells {
            let Ok((mesh, skin, weights, layers)) = skins.get(shell.skin) else { continue };
            let of_skin = meshes.get(&mesh.0);
            if let (Some(of_skin), Some(_)) = (of_skin, weights)
                && let Ok(targets) = of_skin.try_morph_targets()
            {
                let each = targets.chunks_exact(of_skin.count_vertices().max(1));
                let own: Option<Vec<_>> = each.map(|target| shell.made_of.pick(target)).collect();
                shell.mesh.set_morph_targets(own.unwrap_or_default().concat());
            }
            let mut spawned = commands.spawn((
                Name::new("scalp shade"),
                ScalpShell { skin: shell.skin, made_of: shell.made_of },
                Mesh3d(meshes.add(shell.mesh)),
                MeshMaterial3d(material.clone()),
                Transform::from_matrix(shell.place.into()),
                NotShadowCaster,
                ChildOf(hair),
            ));
            skin.map(|skin| spawned.insert(skin.clone()));
            weights.map(|weights| spawned.insert(weights.clone()));
            layers.map(|layers| spawned.insert(layers.clone()));
            all.push(spawned.id());
        }
        commands.entity(hair).insert(ScalpShells(all));
        *shading = Shading::Shown(material);
    }
}

/// Gives shells the colour of their hair.
fn tint(
    hairs: Query<(Entity, &Shading)>,
    (looks, dyes): (Settings<HairLook>, Settings<HairDye>),
    settings: Settings<ScalpShade>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for (hair, shading) in &hairs {
        let Shading::Shown(material) = shading else { continue };
        let (look, dye) = (looks.of(hair), dyes.of(hair));
        let is_most = |i: usize| dye.layers[i].streaks.is_some_and(|streaks| streaks.share >= 0.5);
        let absorption = dye.absorption(look.absorptions().0, 0.0, is_most);
        let color: LinearRgba = HairColor::of(absorption).into();
        let color = color.mix(&LinearRgba::WHITE, look.grey) * BETWEEN;
        let color = Color::from(color.with_alpha(settings.of(hair).strength));
        if materials.get(material).is_some_and(|material| material.base_color != color)
            && let Some(mut material) = materials.get_mut(material)
        {
            material.base_color = color;
        }
    }
}

/// Follows the morph weights of skins, and skins that were edited.
fn follow(
    mut edits: Option<MessageReader<AssetEvent<Mesh>>>,
    replaced: Query<(), Changed<Mesh3d>>,
    skins: Query<(&Mesh3d, Option<Ref<MeshMorphWeights>>), Without<ScalpShell>>,
    mut shown: Query<(&ScalpShell, &Mesh3d, Option<&mut MeshMorphWeights>)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let edits = edits.iter_mut().flat_map(|edits| edits.read());
    let edited = edits.filter_map(|event| match event {
        AssetEvent::Modified { id } => Some(*id),
        _ => None,
    });
    let edited: HashSet<AssetId<Mesh>> = edited.collect();
    for (shell, own, weights) in &mut shown {
        let Ok((mesh, now)) = skins.get(shell.skin) else { continue };
        if let (Some(mut weights), Some(now)) = (weights, now.filter(|now| now.is_changed())) {
            *weights = MeshMorphWeights::clone(&now);
        }
        if !(edited.contains(&mesh.id()) || replaced.contains(shell.skin)) {
            continue;
        }
        // With other vertices the hair is made again, and this with it.
        let over = meshes.get(&mesh.0).and_then(|mesh| shell.made_of.over(mesh));
        if let Some([places, normals]) = over
            && let Some(mut own) = meshes.get_mut(&own.0)
        {
            own.insert_attribute(Mesh::ATTRIBUTE_POSITION, places);
            own.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals);
        }
    }
}
