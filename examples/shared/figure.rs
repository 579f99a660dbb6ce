//! The figure: bones, skin, hair and what hair lies on.

use crate::{
    body, dressed, head,
    skeleton::{self, *},
    solid::Paint,
};
use bevy::{
    camera::visibility::NoFrustumCulling,
    math::Affine3A,
    mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    prelude::*,
};
use bevy_keratin::{
    authoring::{attach::*, collider_fit::*, plant::*},
    prelude::*,
};

/// The whole of it: moves as it walks.
#[derive(Component, Default)]
pub struct Figure {
    /// How long it has walked (s).
    pub walked: f32,
    /// Where the middle of its circle is (m).
    pub place: Vec3,
}

/// What hair it wears.
#[derive(Resource)]
pub struct Wears(pub HairPreset);

/// A bone, by its number.
#[derive(Component)]
pub struct Bone(pub usize);

/// The skin, a skinned mesh.
#[derive(Component)]
pub struct Body;

/// A capsule of the head that hair must stay out of: its ends in the head bone's space, its radius.
#[derive(Component)]
pub struct Skull(pub Vec3, pub Vec3, pub f32);

pub struct FigurePlugin;

impl Plugin for FigurePlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Startup, build).add_systems(Update, walk);
    }
}

/// The middle between the ears; the hairline follows from it.
pub fn scalp() -> Scalp {
    Scalp { center: SKULL, height: 0.118, ..default() }
}

fn build(
    mut commands: Commands,
    mut paint: Paint,
    mut poses: ResMut<Assets<SkinnedMeshInverseBindposes>>,
    wears: Res<Wears>,
) -> Result {
    let (figure, bones) = skeleton::spawn(&mut commands);
    commands.entity(figure).insert((Figure::default(), Visibility::default()));
    for (number, bone) in bones.iter().enumerate() {
        commands.entity(*bone).insert((Bone(number), Visibility::default()));
    }
    let inverse = skeleton::inverse_poses();
    let scalp = scalp();
    let skin = body::mesh();
    let preset = wears.0;
    let planted = preset.plant(&skin, &scalp)?;
    let count = preset.settings().followers.count;
    let line = preset.hairline();
    let mut followers = preset.follower_roots(&planted, &skin, &scalp, &line, count, 0)?;
    // Planted in the skin's space, worn in the head bone's: drawn strands, which are laid out once hair
    // has settled, need both in one.
    let to_bone = -joint(HEAD);
    followers.0.iter_mut().for_each(|root| root.place += to_bone);
    let capsules = fit_joint_capsules(&skin, &inverse)?;

    let body = commands
        .spawn((
            Body,
            Mesh3d(paint.meshes.add(head::with_scalp(skin, &scalp, preset))),
            MeshMaterial3d(paint.matte(Color::WHITE, 0.55)),
            SkinnedMesh { inverse_bindposes: poses.add(inverse), joints: bones.clone() },
            // Its bounds are those at rest.
            NoFrustumCulling,
            ChildOf(figure),
        ))
        .id();

    let hair = commands.spawn((Hair, preset.settings(), followers, ChildOf(bones[HEAD]))).id();
    for strand in planted.groom.strands() {
        let points: Vec<Vec3> = strand.points.iter().map(|point| *point + to_bone).collect();
        commands.spawn((StrandOf(hair), Strand::from_polyline(&points)?));
    }
    println!("{preset:?}: {} guides", planted.groom.len());
    commands.entity(hair).insert(RootsOnMesh {
        mesh: Some(body),
        roots: planted.roots,
        strands_from_mesh: Affine3A::from_translation(to_bone),
        ..default()
    });

    let brows = dressed::brows(preset.settings().look.melanin);
    let face = dressed::face(Vec3::ONE, brows)?.spawn(&mut commands);
    let upright = Quat::from_mat3(&Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X));
    let at = Transform::from_translation(SKULL - joint(HEAD)).with_rotation(upright);
    commands.entity(face).insert((at, ChildOf(bones[HEAD])));

    let (cranium, mut at) = head::cranium()?;
    at.translation += SKULL - joint(HEAD);
    commands.spawn((cranium, at, ChildOf(bones[HEAD])));
    // The rest of a head is no capsule: hair lies on several.
    for (a, b, radius) in head::skull() {
        let [a, b] = [a, b].map(|end| end + SKULL - joint(HEAD));
        commands.spawn((head::limb(a, b, radius)?, Skull(a, b, radius), ChildOf(bones[HEAD])));
    }
    for bone in [1, CHEST, NECK, UPPER_ARM, UPPER_ARM + OTHER_SIDE] {
        if let Some(capsule) = capsules[bone] {
            commands.spawn((capsule.collider()?, ChildOf(bones[bone])));
        }
    }
    commands.spawn(HairCollider::plane(Dir3::Y));
    Ok(())
}

fn walk(
    time: Res<Time>,
    mut figures: Query<(&mut Figure, &mut Transform), Without<Bone>>,
    mut bones: Query<(&Bone, &mut Transform)>,
) {
    for (mut figure, mut place) in &mut figures {
        figure.walked += time.delta_secs();
        *place = path(figure.walked);
        place.translation += figure.place;
        let pose = skeleton::walk(figure.walked);
        for (bone, mut place) in &mut bones {
            *place = pose[bone.0];
        }
    }
}
