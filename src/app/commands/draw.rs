//! The commands of the Model page.

use eframe::egui::{Key, KeyboardShortcut, Modifiers};

use super::list::{add, group, key};
use super::{Command, Menu};
use crate::app::actions::{Action, FindAction, ModelAction, ToEdges};
use crate::app::modelling::tool::{Target, Tool};
use crate::model::from_points::Wanted;
use crate::model::{Axis, Shape};

const NONE: Modifiers = Modifiers::NONE;

pub(super) fn draw(list: &mut Vec<Command>) {
    use Menu::Draw;
    let tools = [
        ("Select and move", Key::V, Tool::Select, "Select what is drawn, and drag it"),
        (
            "Line along x",
            Key::X,
            Tool::Line(Axis::X),
            "Draw edges that run along x, which is level",
        ),
        (
            "Line along y",
            Key::Y,
            Tool::Line(Axis::Y),
            "Draw edges that run along y, level and a quarter turn left of x",
        ),
        ("Line along z", Key::Z, Tool::Line(Axis::Z), "Draw upright edges, from below to above"),
        (
            "Point",
            Key::P,
            Tool::Mark(Target::NewPoint),
            "Show one point in several photographs, which ties them together",
        ),
        ("Origin", Key::O, Tool::Origin, "Say which corner or point lies at (0, 0, 0)"),
        ("Known length", Key::K, Tool::Length, "Say how far two corners or points are apart"),
    ];
    for (name, letter, tool, help) in tools {
        let action = Action::Model(ModelAction::Tool(tool));
        add(list, Draw, name, key(NONE, letter), action, help);
    }
    add(
        list,
        Draw,
        "Snap to edges",
        key(NONE, Key::S),
        Action::Model(ModelAction::Snap),
        "Let lines that are drawn come to lie on edges of the photograph, and corners where two cross, or not",
    );
    for (index, (name, letter, shape, help)) in things().into_iter().enumerate() {
        let put = if index == 0 { group } else { add };
        put(list, Draw, name, key(NONE, letter), Action::Model(ModelAction::Add(shape)), help);
    }
    for (index, (name, key, wanted, help)) in from_points().into_iter().enumerate() {
        let put = if index == 0 { group } else { add };
        let action = Action::Model(ModelAction::Tool(Tool::Lasso(wanted)));
        put(list, Draw, name, Some(key), action, help);
    }
    group(
        list,
        Draw,
        "Turn line around",
        key(NONE, Key::T),
        Action::Model(ModelAction::Flip),
        "Let the selected line run the other way along its axis",
    );
    add(
        list,
        Draw,
        "Fit to edges",
        key(NONE, Key::E),
        Action::Model(ModelAction::FitToEdges(ToEdges::Selected)),
        "Move the selected thing until its outline lies on the lines of the photographs",
    );
    add(
        list,
        Draw,
        "Fit all to edges",
        key(Modifiers::SHIFT, Key::E),
        Action::Model(ModelAction::FitToEdges(ToEdges::All)),
        "Find the lines of the photographs that are edges of things, and solve cameras and things \
         with them",
    );
    add(
        list,
        Draw,
        "Faces or photograph",
        None,
        Action::Model(ModelAction::Blink),
        "Show the model's faces over the photograph, or the photograph again; hold W to see the other",
    );
    add(
        list,
        Draw,
        "Next photograph",
        key(NONE, Key::PageDown),
        Action::Model(ModelAction::Next(true)),
        "Look at the photograph after this one",
    );
    add(
        list,
        Draw,
        "Previous photograph",
        key(NONE, Key::PageUp),
        Action::Model(ModelAction::Next(false)),
        "Look at the photograph before this one",
    );
    group(
        list,
        Draw,
        "Find cameras…",
        None,
        Action::Model(ModelAction::Find(FindAction::Show(true))),
        "Let an engine that is installed place the photographs by points that they show",
    );
    group(
        list,
        Draw,
        "Show the Model page",
        key(NONE, Key::F7),
        Action::Model(ModelAction::Show),
        "Lines and corners on the photographs, which place cameras and things",
    );
    add(
        list,
        Draw,
        "Use this model",
        key(Modifiers::COMMAND, Key::M),
        Action::Model(ModelAction::Use),
        "Write mesh and cameras into the capture, and go on with tagging",
    );
}

/// What can be fitted to points that an engine found.
pub fn from_points() -> [(&'static str, KeyboardShortcut, Wanted, &'static str); 2] {
    [
        (
            "Plane from points",
            KeyboardShortcut::new(NONE, Key::L),
            Wanted::Plane,
            "Draw around points of a flat surface: a rectangle is fitted to those that agree",
        ),
        (
            "Box from points",
            KeyboardShortcut::new(Modifiers::SHIFT, Key::L),
            Wanted::Box,
            "Draw around points of a box: an upright one is fitted to its faces",
        ),
    ]
}

/// The things that can be added, with their keys and what they are.
pub fn things() -> [(&'static str, Key, Shape, &'static str); 5] {
    [
        (
            "Add room",
            Key::R,
            Shape::Room { corners: 4, rectilinear: true, openings: Vec::new() },
            "Floor, walls and ceiling, seen from inside",
        ),
        ("Add box", Key::B, Shape::Box { flush: None }, "An upright box"),
        (
            "Add polygon",
            Key::G,
            Shape::Polygon { corners: 4 },
            "A flat polygon: a picture on a wall, a sheet on a table, a plane of its own",
        ),
        (
            "Add prism",
            Key::J,
            Shape::Prism { corners: 6 },
            "An upright block over an outline of several corners",
        ),
        ("Add cylinder", Key::C, Shape::Cylinder, "An upright cylinder: a can, a column"),
    ]
}
