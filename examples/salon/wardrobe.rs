//! Hairdos: saved, loaded, undone and redone. Knows nothing of the panel that asks for it.

use crate::scenes::Treated;
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use std::{
    error::Error,
    fs, io,
    path::{Path, PathBuf},
};

/// What is wished for. Orders of a frame are carried out at the beginning of the next, before its
/// ticks.
#[derive(Message, Clone, Debug, PartialEq, Eq)]
pub enum Order {
    /// Something is about to change the hair: the present hairdo can be gone back to.
    Remember,
    Undo,
    Redo,
    Save(PathBuf),
    Load(PathBuf),
}

/// The hairdos that were, and those that were undone. The latest last.
#[derive(Resource, Default, Debug)]
pub struct Hairdos {
    past: Vec<Hairdo>,
    future: Vec<Hairdo>,
    /// How the last order went.
    pub reported: String,
}

/// Writes a file whole or not at all: who is interrupted keeps the one that was there.
fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let unfinished = path.with_added_extension("part");
    fs::write(&unfinished, bytes)?;
    fs::rename(unfinished, path)
}

/// How many steps can be undone, and how many nodes they may have together: 100 MB or so.
const STEPS: usize = 50;
const NODES: usize = 1_000_000;

impl Hairdos {
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// Before a change from `now` on. What had been undone is gone.
    pub fn push(&mut self, now: Hairdo) {
        self.future.clear();
        self.past.push(now);
        let mut nodes = 0;
        let kept = self.past.iter().rev().take(STEPS).take_while(|hairdo| {
            nodes += hairdo.nodes();
            nodes <= NODES
        });
        // The step before is kept however large it is.
        let gone = self.past.len() - kept.count().max(1);
        self.past.drain(..gone);
    }

    /// The hairdo before, in exchange for the present one.
    pub fn undo(&mut self, now: Hairdo) -> Option<Hairdo> {
        let before = self.past.pop()?;
        self.future.push(now);
        Some(before)
    }

    /// The hairdo that was undone last, in exchange for the present one.
    pub fn redo(&mut self, now: Hairdo) -> Option<Hairdo> {
        let after = self.future.pop()?;
        self.past.push(now);
        Some(after)
    }
}

pub struct WardrobePlugin;

impl Plugin for WardrobePlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<Order>().init_resource::<Hairdos>().add_systems(First, serve);
    }
}

fn serve(
    mut commands: Commands,
    mut orders: MessageReader<Order>,
    hairs: Query<Entity, With<Treated>>,
) {
    for order in orders.read() {
        let Ok(hair) = hairs.single() else { continue };
        let order = order.clone();
        commands.queue(move |world: &mut World| {
            let reported = carry_out(&order, world, hair).unwrap_or_else(|error| error.to_string());
            world.resource_mut::<Hairdos>().reported = reported;
        });
    }
}

fn carry_out(order: &Order, world: &mut World, hair: Entity) -> Result<String, Box<dyn Error>> {
    let now = Hairdo::of(world, hair)?;
    type Exchange = fn(&mut Hairdos, Hairdo) -> Option<Hairdo>;
    let (go, back): (Exchange, Exchange) = match order {
        Order::Remember => {
            world.resource_mut::<Hairdos>().push(now);
            return Ok(String::new());
        }
        Order::Save(path) => {
            let bytes = now.to_bytes();
            write(path, &bytes).map_err(|error| format!("{}: {error}", path.display()))?;
            return Ok(format!("saved {} kB", bytes.len().div_ceil(1000)));
        }
        Order::Load(path) => {
            let bytes = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
            Hairdo::from_bytes(&bytes)?.apply(world, hair)?;
            world.resource_mut::<Hairdos>().push(now);
            return Ok("loaded".into());
        }
        Order::Undo => (Hairdos::undo, Hairdos::redo),
        Order::Redo => (Hairdos::redo, Hairdos::undo),
    };
    let found = go(&mut world.resource_mut::<Hairdos>(), now);
    let hairdo = found.ok_or("there is no such step")?;
    if let Err(error) = hairdo.apply(world, hair) {
        // Of another scene's hair: the step waits for that scene.
        back(&mut world.resource_mut::<Hairdos>(), hairdo);
        return Err(error.into());
    }
    Ok(String::new())
}
