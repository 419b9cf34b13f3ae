//! The arrangement of the panels in each workspace.

use std::collections::BTreeMap;

use egui_tiles::{Behavior, Container, Linear, LinearDir, Tile, TileId, Tiles, Tree};
use serde::Deserialize;
use serde_json::Value;

use eframe::egui;

use super::panes::{Pane, Place};
use super::workspaces::Workspace;

/// The panels on the right of the workspace of the studies.
const STUDY_RIGHT: [Pane; 3] = [Pane::Run, Pane::Tags, Pane::Log];

impl Workspace {
    /// Whether it has a place for a panel.
    fn has(self, pane: Pane) -> bool {
        let is_study = pane.place() == Place::Study;
        match self {
            Self::Study => is_study || STUDY_RIGHT.contains(&pane),
            _ => !is_study,
        }
    }

    /// Where a panel is shown when the present workspace has no place for it.
    fn home(pane: Pane) -> Self {
        if pane.place() == Place::Study { Self::Study } else { Self::Inspect }
    }

    fn tree(self) -> Tree<Pane> {
        let mut tiles = Tiles::default();
        let at = |place| -> Vec<Pane> {
            Pane::ALL.into_iter().filter(|pane| pane.place() == place).collect()
        };
        let [right_front, lower_front] = self.front();
        let id = egui::Id::unique(("workspace", self.name()));
        if self == Self::Study {
            let studies = tabs(&mut tiles, &at(Place::Study), lower_front);
            let right = tabs(&mut tiles, &STUDY_RIGHT, right_front);
            let parts = [(studies, 0.75), (right, 0.25)];
            let root = split(&mut tiles, LinearDir::Horizontal, &parts);
            return Tree::new(id, root, tiles);
        }
        let outliner = tiles.insert_pane(Pane::Outliner);
        let viewport = tiles.insert_pane(Pane::Viewport);
        let right = tabs(&mut tiles, &at(Place::Right), right_front);
        let lower = tabs(&mut tiles, &at(Place::Lower), lower_front);
        let center = split(
            &mut tiles,
            LinearDir::Vertical,
            &[(viewport, 1.0 - self.lower()), (lower, self.lower())],
        );
        let root = split(
            &mut tiles,
            LinearDir::Horizontal,
            &[(outliner, 0.185), (center, 0.545), (right, 0.27)],
        );
        Tree::new(id, root, tiles)
    }
}

impl Workspace {
    /// Gives an arrangement that was kept the panels that have come since: each beside the one
    /// before it in the list. Says whether it has all of them.
    fn complete(self, tree: &mut Tree<Pane>) -> bool {
        let mut before = None;
        for pane in Pane::ALL.into_iter().filter(|pane| self.has(*pane)) {
            let found = tree.tiles.find_pane(&pane);
            let own = found.or_else(|| {
                let beside = tree.tiles.parent_of(before?)?;
                let id = tree.tiles.insert_pane(pane);
                match tree.tiles.get_mut(beside) {
                    Some(Tile::Container(container)) => container.add_child(id),
                    _ => return None,
                }
                Some(id)
            });
            if own.is_none() {
                return false;
            }
            before = own;
        }
        true
    }
}

fn tabs(tiles: &mut Tiles<Pane>, panes: &[Pane], front: Pane) -> TileId {
    let ids: Vec<TileId> = panes.iter().map(|pane| tiles.insert_pane(*pane)).collect();
    let active = panes.iter().position(|pane| *pane == front).map(|index| ids[index]);
    let mut container = egui_tiles::Tabs::new(ids);
    container.active = active;
    tiles.insert_container(Container::Tabs(container))
}

fn split(tiles: &mut Tiles<Pane>, dir: LinearDir, parts: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear::new(dir, parts.iter().map(|(id, _)| *id).collect());
    for (id, share) in parts {
        linear.shares.set_share(*id, *share);
    }
    tiles.insert_container(Container::Linear(linear))
}

/// Gives the lower panels another part of the height, where they have just this one.
fn set_lower(tree: &mut Tree<Pane>, from: f32, to: f32) {
    for tile in tree.tiles.tiles_mut() {
        if let Tile::Container(Container::Linear(linear)) = tile
            && linear.dir == LinearDir::Vertical
            && let [upper, lower] = linear.children[..]
            && [linear.shares[upper], linear.shares[lower]] == [1.0 - from, from]
        {
            linear.shares.set_share(upper, 1.0 - to);
            linear.shares.set_share(lower, to);
        }
    }
}

pub struct Layout {
    pub current: Workspace,
    trees: BTreeMap<Workspace, Tree<Pane>>,
}

impl Default for Layout {
    fn default() -> Self {
        let trees = Workspace::ALL.map(|workspace| (workspace, workspace.tree()));
        Self { current: Workspace::Capture, trees: trees.into() }
    }
}

impl Layout {
    /// The arrangement of the current workspace.
    pub fn tree(&mut self) -> &mut Tree<Pane> {
        let current = self.current;
        self.trees.entry(current).or_insert_with(|| current.tree())
    }

    /// Shows the panels. In a low window the lower panels take a larger part of the height than in a
    /// high one, until the user moves their edge.
    pub fn ui(&mut self, behavior: &mut dyn Behavior<Pane>, ui: &mut egui::Ui) {
        let lower = self.current.lower();
        let fitted = self.current.lower_in(ui.available_height());
        let tree = self.tree();
        set_lower(tree, lower, fitted);
        tree.ui(behavior, ui);
        set_lower(tree, fitted, lower);
    }

    pub fn reset(&mut self) {
        let current = self.current;
        self.trees.insert(current, current.tree());
    }

    /// Brings a panel to the front, in another workspace where this one has no place for it; one
    /// that was lost comes back with the workspace's own arrangement.
    pub fn show(&mut self, pane: Pane) {
        if !self.current.has(pane) {
            self.current = Workspace::home(pane);
        }
        let is_it = |_: TileId, tile: &Tile<Pane>| matches!(tile, Tile::Pane(own) if *own == pane);
        if !self.tree().make_active(is_it) {
            self.reset();
            self.tree().make_active(is_it);
        }
    }

    /// All arrangements, to be kept.
    pub fn value(&self) -> Value {
        let trees: serde_json::Map<String, Value> = self
            .trees
            .iter()
            .filter_map(|(workspace, tree)| {
                Some((workspace.name().to_owned(), serde_json::to_value(tree).ok()?))
            })
            .collect();
        serde_json::json!({ "workspace": self.current.name(), "trees": trees })
    }

    /// Takes arrangements that were kept; what cannot be read, or lacks a panel, is passed over.
    pub fn restore(&mut self, value: &Value) {
        for workspace in Workspace::ALL {
            if let Some(current) = value.get("workspace").and_then(Value::as_str)
                && current == workspace.name()
            {
                self.current = workspace;
            }
            let stored = value.get("trees").and_then(|trees| trees.get(workspace.name()));
            let tree = stored.and_then(|stored| Tree::<Pane>::deserialize(stored).ok());
            if let Some(mut tree) = tree
                && tree.id() == workspace.tree().id()
                && workspace.complete(&mut tree)
            {
                self.trees.insert(workspace, tree);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_windows_change_only_what_nobody_moved() {
        let mut layout = Layout { current: Workspace::Inspect, ..Layout::default() };
        let kept = layout.value();
        let lower = layout.current.lower();
        assert_eq!(layout.current.lower_in(900.0), lower);
        let fitted = layout.current.lower_in(300.0);
        assert!(fitted > lower);
        set_lower(layout.tree(), lower, fitted);
        assert_ne!(layout.value(), kept);
        // While it is low, the user moves the edge a little.
        let mut moved = layout.tree().clone();
        set_lower(&mut moved, fitted, fitted + 0.01);
        let own = moved.clone();
        set_lower(&mut moved, fitted, lower);
        assert!(moved == own);
        set_lower(layout.tree(), fitted, lower);
        assert_eq!(layout.value(), kept);
    }

    #[test]
    fn arrangements_come_back() {
        let mut layout = Layout { current: Workspace::Inspect, ..Layout::default() };
        layout.show(Pane::Log);
        let kept = layout.value();
        let mut other = Layout::default();
        other.restore(&kept);
        assert_eq!(other.value(), kept);
        other.restore(&serde_json::json!({"trees": {"Tag": {"root": 3}}, "workspace": 5}));
        assert_eq!(other.value(), kept);
        // An arrangement of a version that did not have a panel.
        let mut older = kept.clone();
        let tags = older["trees"]["Tag"].to_string();
        let text = older.to_string().replace("\"KnownLight\"", "\"Log\"");
        older = serde_json::from_str(&text).unwrap();
        assert_ne!(older["trees"]["Tag"].to_string(), tags);
        let mut newer = Layout::default();
        newer.restore(&older);
        newer.current = Workspace::Tag;
        assert!(newer.tree().tiles.find_pane(&Pane::KnownLight).is_some());
        let names = |layout: &Layout| layout.value()["trees"]["Tag"].to_string();
        assert_ne!(names(&newer), names(&Layout::default()), "the rest stays as it was");
        other.show(Pane::Stability);
        assert_eq!(other.current, Workspace::Study);
        other.show(Pane::Log);
        assert_eq!(other.current, Workspace::Study);
        other.show(Pane::Compare);
        assert_eq!(other.current, Workspace::Inspect);
    }
}
