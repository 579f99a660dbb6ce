//! Making hair for a head: planting or converting a groom, roots, colliders. A pure function, for
//! any thread.

use super::{
    error::WearError,
    facing::FacingFrom,
    fall::Fall,
    garments::{garments, is_sheet},
    helmets::{Helmet, helmets},
    part::{HEAD_WEIGHT, MeshPart, positions},
    skin::{Hint, Role},
    space::{Fitting, cropped, fit},
    target::Target,
    what::{HairSource, WearHair},
};
#[cfg(feature = "render")]
use super::{
    shell::{Shell, Skin, drawn, shells},
    space::FittedPart,
};
#[cfg(feature = "render")]
use crate::{
    authoring::plant::FollowerPlanting, base::setting::Ranged, hair::look::HairLook,
    render::FollowerRoots,
};
use crate::{
    authoring::{
        collider_fit::{
            BallRules, ProtrusionRules, fit_joint_capsules, inscribed_balls, protrusions,
        },
        groom::{Groom, GroomGuides, GrownStrands},
        plant::{
            HUMAN_DENSITY, PresetSettings, RootOnMesh, RootPlace, SurfacePoint, surface_points,
        },
        recipe::HairRecipe,
    },
    base::{fault::HairFault, grid::KdTree},
    forces::contact::{HairCollider, StrandContact},
    hair::{look::WornPreset, strand::Strand},
    keratin::bond::Bonds,
    simulation::settle::{SettleAhead, SettleConditions, Settled},
    solver::rod::{HairStiffness, StrandMaterial},
    water::HairWetting,
};
use bevy::{
    ecs::entity::EntityHashMap,
    math::{
        Affine3A,
        bounding::{Aabb3d, BoundingVolume},
        ops::sin_cos,
    },
    mesh::VertexAttributeValues as Values,
    platform::collections::{HashMap, HashSet},
    prelude::*,
};
use std::sync::Arc;

/// Surface points of head and body for fitting balls.
const POINTS: usize = 2500;
/// Largest number of balls for a head, and for a joint.
const MAX_BALLS: usize = 48;
const MAX_JOINT_BALLS: usize = 32;
/// A capsule that is farther from the skin than this, as a root mean square (m), gives way to balls.
const LOOSE: f32 = 4e-3;
/// So does one whose ends are farther outside of the skin (m), as over shoulders that another joint moves, and from
/// how many sides that is seen.
const STANDS_OUT: f32 = 15e-3;
const SIDES: u32 = 64;
/// How far balls stand out of a head's skin and of a joint's (m), and how far outside of one a point is that it
/// covers (m; negative within it). Of a figure's nodes and drawn strands less than 0.1 % are in the skin then; with
/// 24 balls of a joint, or 3 mm out, it would be up to 0.6 %, in the creases between them.
const OUT: f32 = 3e-3;
const CREASE: f32 = -3e-4;
const JOINT_OUT: f32 = 5e-3;
const JOINT_CREASE: f32 = 5e-4;
/// What balls of a head leave out, by so many points of the surface: ears are thinner than any ball.
const EARS: ProtrusionRules =
    ProtrusionRules { apart: -5e-4, link: 0.018, longest: 0.06, out: 1.5e-3 };
const FINE_POINTS: usize = 15_000;
/// How far from hair's roots these points are at least (m): what grows in a solid is pushed out of it.
const BARE: f32 = 8e-3;
/// Height of a head, as [`Scalp`](crate::authoring::plant::Scalp) measures it (m).
const HEAD: f32 = 0.133;
/// Distance beyond the hair's length within which meshes are considered (m).
const MARGIN: f32 = 0.15;
/// Largest median distance of a groom's roots from the mesh (m).
const MAX_ROOT_DISTANCE: f32 = 0.03;
/// Units that grooms are made in, in metres, and metres of characters that are in these: what is tried where a groom
/// is far from its mesh; and how wide its roots then lie, on a head of life size (m).
const UNITS: [f32; 7] = [0.01, 0.001, 0.0254, 0.1, 10.0, 100.0, 1000.0];
const WIDTHS: core::ops::RangeInclusive<f32> = 0.06..=3.0;

/// What a [`HairSource`] names, loaded.
#[derive(Clone)]
pub(super) enum Source {
    Groom(Groom, GroomGuides),
    /// Also of a preset.
    Recipe(HairRecipe),
}

impl Source {
    /// What of its settings counts as it settles; that of all hair where it has none of its own.
    fn settles_as(&self) -> Option<(HairStiffness, StrandContact)> {
        let Self::Recipe(recipe) = self else { return None };
        let PresetSettings { stiffness, contact, .. } = recipe.settings();
        Some((stiffness, contact))
    }
}

/// What one hair of a wear is made of.
#[derive(Clone)]
pub(super) struct HairInput {
    pub(super) source: Source,
    /// Whether it is worn already: colliders leave room for it.
    pub(super) is_kept: bool,
}

/// The input for making hair.
pub(super) struct MakeInput {
    pub(super) wear: WearHair,
    pub(super) target: Target,
    /// For each hair of the wear.
    pub(super) hairs: Vec<HairInput>,
    /// How the hairs fell that are worn now.
    pub(super) before: Vec<Arc<Fall>>,
    pub(super) conditions: SettleConditions,
    /// Whether it shades the skin.
    pub(super) shades: bool,
}

impl MakeInput {
    /// Gravity as it settles, in the wearer's space: along the nearest of its axes, so that it does not hang on how
    /// the wearer moves at the time.
    pub(super) fn down(&self) -> Vec3 {
        let gravity = self.target.turn.inverse() * self.conditions.gravity;
        let axis = gravity.abs().max_position();
        let mut along = Vec3::ZERO;
        along[axis] = self.conditions.gravity.length().copysign(gravity[axis]);
        along
    }
}

/// Finished hair, ready to be spawned.
#[derive(Clone)]
pub(super) struct Made {
    /// Its parent bone or mesh, and its transform there.
    pub(super) parent: Entity,
    pub(super) place: Transform,
    /// The meshes that its roots are tied to, each with the transform from its space to the strands'.
    pub(super) skin: Vec<(Entity, Affine3A)>,
    /// Each hair of the wear; `None` where it is kept.
    pub(super) hairs: Vec<Option<MadeHair>>,
    /// The meshes that it was fitted to, and the colliders.
    pub(super) parts: Vec<Entity>,
    pub(super) solids: Solids,
    /// Where the face looks, in the wearer's space, and what shows it.
    pub(super) facing: (Dir3, FacingFrom),
    /// What was chosen, to be logged.
    pub(super) choice: String,
    /// The meshes of hair that the character came with.
    #[cfg_attr(not(feature = "render"), allow(dead_code, reason = "only what is drawn is hidden"))]
    pub(super) old_hair: Vec<Entity>,
}

/// One finished hair.
#[derive(Clone)]
pub(super) struct MadeHair {
    pub(super) roots: Vec<RootOnMesh>,
    /// Its strands at rest, with their bonds, how they fell if that was found out, and what was reported meanwhile.
    pub(super) strands: Vec<(Strand, Bonds)>,
    /// What each is beside the others; empty where all are alike.
    pub(super) materials: Vec<StrandMaterial>,
    pub(super) fall: Option<Arc<Fall>>,
    /// Whether it took over how other hair lay.
    pub(super) is_carried: bool,
    pub(super) faults: Vec<HairFault>,
    #[cfg(feature = "render")]
    pub(super) followers: FollowerRoots,
    /// What shades its skin.
    #[cfg(feature = "render")]
    pub(super) shells: Option<Vec<Shell>>,
    pub(super) settings: Option<PresetSettings>,
    pub(super) preset: Option<WornPreset>,
    pub(super) recipe: Option<HairRecipe>,
    #[cfg(feature = "render")]
    pub(super) look: Option<HairLook>,
    /// Fibres for each strand.
    pub(super) fibres: f32,
}

impl Made {
    /// Makes it over to another wearer, with these entities in place of those that it was made for.
    pub(super) fn give_to(&mut self, entities: &EntityHashMap<Entity>) {
        let skin = self.skin.iter_mut().map(|(mesh, _)| mesh);
        let joints = self.solids.capsules.iter_mut().map(|(joint, _)| joint);
        let helmets = self.solids.helmets.iter_mut();
        let of_helmets = helmets.flat_map(|(on, (helmet, _))| [on, &mut helmet.mesh]);
        let all = core::iter::once(&mut self.parent).chain(skin).chain(joints).chain(of_helmets);
        #[cfg(feature = "render")]
        let all = all.chain(
            (self.hairs.iter_mut().flatten())
                .flat_map(|hair| hair.shells.iter_mut().flatten().map(|shell| &mut shell.skin)),
        );
        for entity in all.chain(&mut self.parts).chain(&mut self.old_hair) {
            if let Some(own) = entities.get(entity) {
                *entity = *own;
            }
        }
    }
}

/// Colliders that fit a head and its body.
#[derive(Clone, Default)]
pub(super) struct Solids {
    /// In the hair's space.
    pub(super) balls: Vec<(HairCollider, Transform)>,
    /// Of joints.
    pub(super) capsules: Vec<(Entity, (HairCollider, Transform))>,
    /// Of what they move with.
    pub(super) helmets: Vec<(Entity, (Helmet, Transform))>,
}

impl Solids {
    /// Moves what is in the hair's space into that of another.
    pub(super) fn move_balls(&mut self, to_other: Mat4) {
        for (_, place) in &mut self.balls {
            *place = Transform::from_matrix(to_other * place.to_matrix());
        }
    }
}

/// Where worn hair grows.
pub(super) struct Rooted {
    /// The meshes of its roots, each with the transform from its space to the strands'.
    pub(super) skin: Vec<(Entity, Affine3A)>,
    pub(super) roots: Vec<RootOnMesh>,
}

/// The input for fitting colliders to meshes that have changed below hair that is worn.
pub(super) struct RefitInput {
    pub(super) wear: WearHair,
    pub(super) target: Target,
    /// Where each hair grows.
    pub(super) hairs: Vec<Rooted>,
    /// The length of the longest strand (m).
    pub(super) longest: f32,
}

/// Fits colliders again, in the space that the first hair was made in and stays in.
pub(super) fn refit(mut order: RefitInput) -> Result<Solids, WearError> {
    let fitting = fit(&mut order.target.parts, &order.wear)?;
    let part_of = |mesh: &Entity| {
        order.target.parts.iter().find(|part| part.entity == *mesh).ok_or(WearError::NoMesh)
    };
    let mut roots = Vec::new();
    for hair in &order.hairs {
        let mut places = Vec::new();
        for (mesh, _) in &hair.skin {
            let part = part_of(mesh)?;
            let to_hair = fitting.from_wearer * part.to_wearer;
            let own = part.mesh.attribute(Mesh::ATTRIBUTE_POSITION);
            let Some(Values::Float32x3(own)) = own else { return Err(WearError::NoMesh) };
            places.extend(own.iter().map(|p| to_hair.transform_point3(Vec3::from(*p))));
        }
        roots.extend(hair.roots.iter().filter_map(|root| {
            let corner = |i: usize| places.get(root.vertices[i] as usize).copied();
            let [a, b, c] = [corner(0)?, corner(1)?, corner(2)?];
            let [u, v, w] = root.weights.to_array();
            Some(a * u + b * v + c * w)
        }));
    }
    let first = order.hairs.first().and_then(|hair| hair.skin.first());
    let (main, from_mesh) = first.ok_or(WearError::NoMesh)?;
    let to_hair = fitting.from_wearer * part_of(main)?.to_wearer;
    let mut solids = fit_solids(&fitting, &order.target, roots, order.longest)?;
    solids.move_balls(Mat4::from(*from_mesh * to_hair.inverse()));
    Ok(solids)
}

/// The colliders for hair with these `roots` in its space, whose `longest` strand is so long (m).
fn fit_solids(
    fitting: &Fitting,
    target: &Target,
    roots: Vec<Vec3>,
    longest: f32,
) -> Result<Solids, WearError> {
    let head = match &target.parts[fitting.part()].skin {
        Some(skin) => skin.joints[skin.head.unwrap_or(0)],
        None => target.head,
    };
    let reach = longest + MARGIN;
    let balls = match target.own.above.contains(&head) {
        true => Vec::new(),
        false => balls(fitting, &roots, reach)?,
    };
    // A cape of the same skin is no limb.
    let is_garment = |(i, part): &(usize, &MeshPart)| {
        fitting.roles[*i].is_none() && part.skin.is_some() && is_sheet(part)
    };
    let (capes, limbs): (Vec<_>, Vec<_>) = target.parts.iter().enumerate().partition(is_garment);
    let limbs: Vec<&MeshPart> = limbs.into_iter().map(|(_, part)| part).collect();
    let capes = capes.into_iter().map(|(_, part)| part).filter(|part| part.is_shown);
    let mut capsules = capsules(&limbs, &target.own.joints, fitting, reach);
    let worn = capes.chain(&target.garments);
    capsules.extend(garments(worn, &target.own.joints, fitting, &roots, reach));
    let helmets = helmets(target, fitting, &roots);
    Ok(Solids { balls, capsules, helmets })
}

/// Makes the hairs of a wear, which settle as long as they are `wanted`.
pub(super) fn make(
    mut order: MakeInput,
    wanted: &(dyn Fn() -> bool + Sync),
) -> Result<Made, WearError> {
    order.wear.check_beside()?;
    let mut presets = HashSet::new();
    for input in &order.hairs {
        if let Source::Recipe(recipe) = &input.source
            && !presets.insert(recipe.preset())
        {
            return Err(WearError::Twice { hair: format!("the preset {:?}", recipe.preset()) });
        }
    }
    let fitting = fit(&mut order.target.parts, &order.wear)?;
    let each: Vec<WearHair> = order.wear.each().collect();
    let grown = each.iter().zip(&order.hairs).map(|(wear, input)| match &input.source {
        Source::Groom(groom, guides) => from_groom(groom, guides, &fitting, &wear.place),
        Source::Recipe(recipe) => plant(recipe, wear, &fitting, !input.is_kept),
    });
    let grown: Vec<Grown> = grown.collect::<Result<_, _>>()?;
    let part = &order.target.parts[fitting.part()];
    let to_mesh = fitting.skin[0].to_hair.inverse();
    let (parent, place) = match &part.skin {
        Some(skin) => {
            let head = skin.head.unwrap_or(0);
            (skin.joints[head], skin.poses[head] * to_mesh)
        }
        None => (part.entity, to_mesh),
    };
    let solids = if order.wear.colliders {
        let strands = || grown.iter().flat_map(|grown| &grown.hair.strands);
        let roots = strands().filter_map(|strand| strand.positions().first().copied());
        let longest = strands().map(Strand::length).fold(0.0, f32::max);
        fit_solids(&fitting, &order.target, roots.collect(), longest)?
    } else {
        default()
    };
    let hairs = grown.into_iter().zip(&each).zip(&order.hairs).map(|((grown, wear), input)| {
        let of = (wear, &input.source);
        (!input.is_kept).then(|| finish(&order, of, grown, &fitting, &solids, wanted))
    });
    Ok(Made {
        parent,
        place: Transform::from_matrix(place.into()),
        skin: (fitting.skin.iter())
            .map(|of| (order.target.parts[of.part].entity, of.to_hair))
            .collect(),
        hairs: hairs.collect(),
        parts: order.target.parts.iter().map(|part| part.entity).collect(),
        solids,
        facing: fitting.facing,
        choice: choice(&fitting, &order.target.parts),
        old_hair: old_hair(&fitting, &order.target.parts),
    })
}

/// Lays a hair, as it settles, as hair of the same roots did before, or as planted where a saved style is put on it.
#[cfg_attr(not(feature = "save"), allow(unused_variables, reason = "a saved style is put on"))]
fn finish(
    order: &MakeInput,
    (wear, source): (&WearHair, &Source),
    grown: Grown,
    fitting: &Fitting,
    solids: &Solids,
    wanted: &(dyn Fn() -> bool + Sync),
) -> MadeHair {
    let planted = &grown.hair.strands;
    #[cfg(feature = "save")]
    let is_styled = wear.hairdo.is_some();
    #[cfg(not(feature = "save"))]
    let is_styled = false;
    let mut before = order.before.iter().filter(|_| !is_styled);
    let carried = before.find_map(|fall| Some((fall.carried(planted)?, fall.clone())));
    let is_carried = carried.is_some();
    let (rested, fall) = match carried {
        _ if is_styled => (Settled::as_planted(planted), None),
        Some((strands, fall)) => (Settled { strands, faults: Vec::new() }, Some(fall)),
        None => {
            let rested = settle(order, fitting, (&grown, source), solids, wanted);
            let fall = Fall::new(planted, &rested.strands);
            (rested, Some(Arc::new(fall)))
        }
    };
    let fibres = HairWetting::FIBRES.safe;
    #[cfg(feature = "render")]
    let shells = order.shades.then(|| shade(&order.target, fitting, &grown));
    MadeHair {
        roots: grown.roots,
        strands: rested.strands,
        materials: grown.hair.materials,
        fall,
        is_carried,
        faults: rested.faults,
        #[cfg(feature = "render")]
        shells,
        #[cfg(feature = "render")]
        followers: grown.hair.followers,
        settings: grown.settings,
        preset: grown.preset,
        recipe: grown.recipe,
        #[cfg(feature = "render")]
        look: grown.look,
        fibres: grown.fibres.clamp(*fibres.start(), *fibres.end()),
    }
}

/// What shades the skin under it.
#[cfg(feature = "render")]
fn shade(target: &Target, fitting: &Fitting, grown: &Grown) -> Vec<Shell> {
    let skin = |of: &FittedPart| {
        let part = &target.parts[of.part];
        Skin { entity: part.entity, mesh: part.mesh.clone(), to_hair: of.to_hair }
    };
    let skins: Vec<Skin> = fitting.skin.iter().map(skin).collect();
    shells(&skins, &drawn(&grown.hair.followers, &grown.roots, &skins))
}

/// Lets it settle on the character as it is bound to its skeleton.
fn settle(
    order: &MakeInput,
    fitting: &Fitting,
    (grown, source): (&Grown, &Source),
    solids: &Solids,
    wanted: &(dyn Fn() -> bool + Sync),
) -> Settled {
    let Target { parts, garments, own, size, .. } = &order.target;
    let mut joints: HashMap<Entity, Affine3A> = default();
    for part in parts.iter().chain(garments) {
        let Some(skin) = &part.skin else { continue };
        let to_hair = fitting.from_wearer * part.to_wearer;
        for (joint, pose) in skin.joints.iter().zip(&skin.poses) {
            joints.entry(*joint).or_insert_with(|| to_hair * pose.inverse());
        }
    }
    let placed = |place: Affine3A| Transform::from_matrix(place.into());
    let capsules = solids.capsules.iter().filter_map(|(joint, (collider, place))| {
        Some((collider.clone(), placed(*joints.get(joint)? * place.compute_affine())))
    });
    let own = own.solids.iter().filter_map(|solid| {
        let there = match solid.joint {
            Some(joint) => *joints.get(&joint)?,
            None => fitting.from_wearer,
        };
        Some((solid.collider.clone(), placed(there * solid.place)))
    });
    let solids: Vec<_> = solids.balls.iter().cloned().chain(capsules).chain(own).collect();
    let scale = fitting.from_wearer.matrix3.determinant().abs().cbrt();
    let down = fitting.from_wearer.transform_vector3(order.down()) / scale;
    let ahead = SettleAhead {
        strands: &grown.hair.strands,
        materials: &grown.hair.materials,
        own: source.settles_as(),
        solids: &solids,
        size: size / scale,
        gravity: down,
        conditions: &order.conditions,
    };
    ahead.settle(wanted).unwrap_or_else(|| Settled::as_planted(&grown.hair.strands))
}

/// What was chosen among the meshes that move with the head, in words.
fn choice(fitting: &Fitting, parts: &[MeshPart]) -> String {
    let names = |is: fn(&MeshPart, Option<Role>) -> bool| {
        let all = parts.iter().zip(&fitting.roles).filter(|(part, role)| is(part, **role));
        all.map(|(part, _)| format!("{:?}", part.name)).collect::<Vec<_>>().join(", ")
    };
    let mut text = format!("it grows on {}", names(|_, role| role == Some(Role::Skin)));
    let others = [
        ("over it", names(|_, role| role == Some(Role::Over))),
        ("within", names(|_, role| role == Some(Role::Within))),
        ("hidden", names(|part, role| role.is_none() && !part.is_shown)),
    ];
    for (what, names) in others.into_iter().filter(|(_, names)| !names.is_empty()) {
        text += &format!("; {what}: {names}");
    }
    text
}

/// Meshes that lie over the scalp, and are not named like what is no hair.
fn old_hair(fitting: &Fitting, parts: &[MeshPart]) -> Vec<Entity> {
    let scalp = &fitting.scalp;
    let lies_on_scalp = |part: &MeshPart| {
        let to_hair = fitting.from_wearer * part.to_wearer;
        let places = match part.mesh.attribute(Mesh::ATTRIBUTE_POSITION) {
            Some(Values::Float32x3(places)) => &places[..],
            _ => &[],
        };
        let behind =
            |p: &&[f32; 3]| scalp.behind_hairline(to_hair.transform_point3(Vec3::from(**p))) > 0.0;
        4 * places.iter().filter(behind).count() > places.len()
    };
    let is_old = |(part, role): &(&MeshPart, &Option<Role>)| {
        **role == Some(Role::Over)
            && !matches!(Hint::of(&part.name), Hint::Worn | Hint::Skin)
            && lies_on_scalp(part)
    };
    parts.iter().zip(&fitting.roles).filter(is_old).map(|(part, _)| part.entity).collect()
}

/// Hair on a mesh.
struct Grown {
    hair: GrownStrands,
    roots: Vec<RootOnMesh>,
    /// Before a recipe has changed them.
    settings: Option<PresetSettings>,
    preset: Option<WornPreset>,
    recipe: Option<HairRecipe>,
    #[cfg(feature = "render")]
    look: Option<HairLook>,
    fibres: f32,
}

/// Grows hair by a recipe. Hair that is kept draws none: only its roots count.
#[cfg_attr(not(feature = "render"), allow(unused_variables, reason = "followers are drawn"))]
fn plant(
    recipe: &HairRecipe,
    wear: &WearHair,
    fitting: &Fitting,
    is_drawn: bool,
) -> Result<Grown, WearError> {
    let length = WornPreset::LENGTH.named("WearHair::length").check(wear.length)?;
    let preset = recipe.preset();
    let worn = WornPreset { seed: wear.seed, length, ..WornPreset::of(preset) };
    let mut planting = recipe.planting(&fitting.scalp);
    // A file may have a seed as well.
    if wear.seed != 0 {
        planting.seed = wear.seed;
    }
    let own_length = planting.length;
    if worn.length != 1.0 {
        planting = planting.lengthened(worn.length);
    }
    let settings = recipe.settings();
    let whole = preset.is_everywhere();
    let within = |reach: f32| match whole {
        true => fitting.mesh.clone(),
        false => cropped(&fitting.mesh, reach + MARGIN),
    };
    // Roots are the same whatever the length is.
    let mesh = within(own_length);
    let beside = (worn.length > 1.0).then(|| within(planting.length));
    let of_head = |place: &RootPlace| match place.color {
        Some(color) if !whole && color.x <= HEAD_WEIGHT => 0.0,
        _ => 1.0,
    };
    let planted = preset.plant_where(
        &planting,
        [&mesh, beside.as_ref().unwrap_or(&mesh)],
        &fitting.scalp,
        &of_head,
    )?;
    let strands = planted.groom.strands().map(|s| Strand::from_polyline(s.points));
    let hair = GrownStrands {
        strands: strands.collect::<Result<_, _>>()?,
        #[cfg(feature = "render")]
        followers: FollowerPlanting {
            preset,
            scalp: fitting.scalp,
            hairline: (wear.hairline.map(Ranged::checked).transpose()?)
                .map_or_else(|| recipe.hairline().checked(), Ok)?,
            count: if is_drawn { settings.followers.checked()?.count } else { 0 },
            seed: wear.seed,
        }
        .plant(&planted, &mesh, &of_head)?,
        ..default()
    };
    Ok(Grown {
        hair,
        roots: planted.roots,
        settings: Some(preset.settings()),
        // What a preset grows is known by its name; what a recipe grows, by the recipe.
        preset: matches!(wear.hair, HairSource::Preset(_)).then_some(worn),
        recipe: matches!(wear.hair, HairSource::Recipe(_)).then(|| recipe.clone()),
        #[cfg(feature = "render")]
        look: None,
        fibres: HUMAN_DENSITY / planting.density,
    })
}

fn from_groom(
    groom: &Groom,
    guides: &GroomGuides,
    fitting: &Fitting,
    place: &Transform,
) -> Result<Grown, WearError> {
    let in_hair = groom.clone().mapped(&(fitting.from_wearer * place.compute_affine()))?;
    let hair = in_hair.grown_strands(guides)?;
    let places: Vec<Vec3> = hair.strands.iter().map(|s| s.positions()[0]).collect();
    let (roots, mut apart): (Vec<_>, Vec<_>) =
        RootOnMesh::nearest(&fitting.mesh, places.iter().copied())?.into_iter().unzip();
    let found = median(&mut apart).unwrap_or(0.0);
    if found > MAX_ROOT_DISTANCE {
        let scale = unit_that_fits(groom, fitting, place);
        return Err(WearError::Beside { found, most: MAX_ROOT_DISTANCE, scale });
    }
    Ok(Grown {
        fibres: HUMAN_DENSITY * area_of_each(&places),
        hair,
        roots,
        settings: None,
        preset: None,
        recipe: None,
        #[cfg(feature = "render")]
        look: groom.look(),
    })
}

/// The unit (m) in which the groom would be on the mesh and of a likely size, were its lengths in that.
fn unit_that_fits(groom: &Groom, fitting: &Fitting, place: &Transform) -> Option<f32> {
    let is_near = |unit: &f32| {
        let unit = Affine3A::from_scale(Vec3::splat(*unit));
        let to_hair = fitting.from_wearer * place.compute_affine() * unit;
        let roots = groom.strands().filter_map(|strand| strand.points.first());
        let places: Vec<Vec3> = roots.map(|root| to_hair.transform_point3(*root)).collect();
        let around = Aabb3d::from_point_cloud(Isometry3d::IDENTITY, places.iter().copied());
        if !WIDTHS.contains(&(2.0 * around.half_size().max_element())) {
            return Some(false);
        }
        let near = RootOnMesh::nearest(&fitting.mesh, places).ok()?;
        let mut apart: Vec<f32> = near.into_iter().map(|(_, apart)| apart).collect();
        Some(median(&mut apart)? < MAX_ROOT_DISTANCE)
    };
    UNITS.into_iter().find(|unit| is_near(unit) == Some(true))
}

/// Approximate area of skin per root (m²), from the distances of neighbours.
fn area_of_each(places: &[Vec3]) -> f32 {
    let tree = KdTree::new(places.iter().copied().zip(0u32..));
    let apart = |p: &Vec3| tree.nearest::<2>(*p).nth(1).map(|(_, square)| square);
    let mut squares: Vec<f32> = places.iter().filter_map(apart).collect();
    median(&mut squares).unwrap_or(0.0)
}

fn median(values: &mut [f32]) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Balls that fill the head and stand a little out of it, and ellipsoids around its ears; for a mesh without
/// joints, all of it that hair reaches.
fn balls(
    fitting: &Fitting,
    roots: &[Vec3],
    reach: f32,
) -> Result<Vec<(HairCollider, Transform)>, WearError> {
    let cropped = cropped(&fitting.mesh, reach);
    let points = surface_points(&cropped, POINTS)?;
    let height = fitting.scalp.height;
    let is_on_head = |p: &SurfacePoint| p.red > HEAD_WEIGHT && p.at.length() < reach;
    let places: Vec<_> = points.iter().map(|p| (p.at, p.normal)).collect();
    let rules = BallRules {
        widest: 0.9 * height,
        out: OUT * height / HEAD,
        crease: CREASE,
        most: MAX_BALLS,
    };
    let balls = inscribed_balls(&places, |i| is_on_head(&points[i]), &rules);
    let skin = surface_points(&cropped, FINE_POINTS)?;
    let size = height / HEAD;
    let near_roots = KdTree::new(roots.iter().copied().zip(0u32..));
    let clear = (0, (BARE * size).powi(2));
    let is_bare = |p: &SurfacePoint| near_roots.nearer_than(p.at, clear) == clear;
    let bare = skin.iter().filter(|p| is_on_head(p) && is_bare(p)).map(|p| p.at);
    let ears = protrusions(bare, &balls, &EARS.scaled(size)).into_iter();
    // Around what is bare there may be roots within: those of a sideburn in the ellipsoid around ear and temple.
    let ears = ears.filter_map(|ear| ear.clear_of(roots));
    let balls = balls.into_iter().map(|ball| {
        let place = Transform::from_translation(ball.center.into());
        Ok((HairCollider::sphere(ball.radius())?, place))
    });
    let ears = ears.map(|ear| Ok((HairCollider::ellipsoid(ear.radii)?, ear.place)));
    balls.chain(ears).collect()
}

/// For each joint that hair reaches the capsule that fits, or balls where it is of another shape; none for the
/// head's, for those `with_own` colliders, and where the fit fails.
fn capsules(
    parts: &[&MeshPart],
    with_own: &HashSet<Entity>,
    fitting: &Fitting,
    reach: f32,
) -> Vec<(Entity, (HairCollider, Transform))> {
    let mut best: HashMap<Entity, (f32, Vec<(HairCollider, Transform)>)> = default();
    let mut order = Vec::new();
    // What is hidden holds no hair, unless all is.
    let is_any_shown = parts.iter().any(|part| part.is_shown);
    for part in parts.iter().filter(|part| part.is_shown || !is_any_shown) {
        let Some(skin) = &part.skin else { continue };
        let poses: Vec<Mat4> = skin.poses.iter().map(|pose| (*pose).into()).collect();
        let to_hair = fitting.from_wearer * part.to_wearer;
        let Ok(fitted) = fit_joint_capsules(&part.mesh, &poses) else { continue };
        let near = near_skin(part, &to_hair, reach);
        for (i, capsule) in fitted.into_iter().enumerate() {
            let is_fitted = || !skin.of_head[i] && !with_own.contains(&skin.joints[i]);
            let Some(capsule) = capsule.filter(|_| is_fitted()) else { continue };
            let there = to_hair * skin.poses[i].inverse();
            let scale = there.matrix3.determinant().abs().cbrt();
            let [a, b] = [capsule.from, capsule.to].map(|end| there.transform_point3(end));
            let radius = capsule.radius * scale;
            let nearest = Segment3d::new(a, b).closest_point(Vec3::ZERO).length() - radius;
            let is_near = nearest < reach;
            let Some(collider) = capsule.collider().ok().filter(|_| is_near) else { continue };
            let joint = skin.joints[i];
            match best.get(&joint) {
                Some(known) if known.0 >= radius => {}
                known => {
                    if known.is_none() {
                        order.push(joint);
                    }
                    let is_loose = capsule.deviation * scale > LOOSE;
                    let balls = match is_loose || stands_out([a, b], radius, &near.1) {
                        true => joint_balls(i, &near, &there),
                        false => Vec::new(),
                    };
                    let solids = if balls.is_empty() { vec![collider] } else { balls };
                    best.insert(joint, (radius, solids));
                }
            }
        }
    }
    let solids = order.into_iter().filter_map(|joint| Some((joint, best.remove(&joint)?.1)));
    solids.flat_map(|(joint, all)| all.into_iter().map(move |solid| (joint, solid))).collect()
}

/// Vertices within reach, some of them where they are many: the joint that moves most of each, and where it is in
/// the hair's space with its normal.
fn near_skin(part: &MeshPart, to_hair: &Affine3A, reach: f32) -> (Vec<usize>, Vec<(Vec3, Vec3)>) {
    let normals = match part.mesh.attribute(Mesh::ATTRIBUTE_NORMAL) {
        Some(Values::Float32x3(normals)) => &normals[..],
        _ => &[],
    };
    let joints = part.joints_of_vertices().unwrap_or_default();
    let each =
        positions(&part.mesh).iter().zip(normals).zip(joints).map(|((at, normal), joint)| {
            let normal = to_hair.transform_vector3(Vec3::from(*normal)).normalize_or_zero();
            (joint, (to_hair.transform_point3(Vec3::from(*at)), normal))
        });
    let near: Vec<_> = each.filter(|(_, (at, _))| at.length() < reach).collect();
    let step = near.len().div_ceil(POINTS).max(1);
    near.into_iter().step_by(step).unzip()
}

/// Whether an end of a capsule is far outside of the skin.
fn stands_out([a, b]: [Vec3; 2], radius: f32, skin: &[(Vec3, Vec3)]) -> bool {
    (0..SIDES).any(|k| {
        let up = 1.0 - (2.0 * k as f32 + 1.0) / SIDES as f32;
        // By the golden angle.
        let (sine, cosine) = sin_cos(2.399_963 * k as f32);
        let way = Vec3::new(cosine, 0.0, sine) * (1.0 - up * up).sqrt() + Vec3::Y * up;
        let at = way * radius + if way.dot(b - a) > 0.0 { b } else { a };
        let apart = |p: &&(Vec3, Vec3)| p.0.distance_squared(at);
        let nearest = skin.iter().min_by(|p, q| apart(p).total_cmp(&apart(q)));
        nearest.is_some_and(|(p, normal)| (at - p).dot(*normal) > STANDS_OUT)
    })
}

/// Balls that fill what joint `i` moves for the greater part, in the space of the joint, given the skin that is
/// near and the transform from the joint's space to the hair's.
fn joint_balls(
    i: usize,
    (joints, points): &(Vec<usize>, Vec<(Vec3, Vec3)>),
    from_joint: &Affine3A,
) -> Vec<(HairCollider, Transform)> {
    let rules =
        BallRules { widest: 0.12, out: JOINT_OUT, crease: JOINT_CREASE, most: MAX_JOINT_BALLS };
    let (to_joint, scale) = (from_joint.inverse(), from_joint.matrix3.determinant().abs().cbrt());
    let balls = inscribed_balls(points, |k| joints[k] == i, &rules);
    let each = balls.into_iter().filter_map(|ball| {
        let place = to_joint.transform_point3(ball.center.into());
        let ball = HairCollider::sphere(ball.radius() / scale).ok()?;
        Some((ball, Transform::from_translation(place)))
    });
    each.collect()
}
