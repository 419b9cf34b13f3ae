//! The commands about what photographs show: masks and charts.

use eframe::egui::{Key, Modifiers};

use super::list::{COMMAND, add, key, put_within};
use super::{Command, Menu};
use crate::app::actions::{Action, Charting, Masking, NewChart, PathRequest};
use crate::app::viewport::MaskTool;

pub(super) fn charts(list: &mut Vec<Command>) {
    use Menu::Edit;
    let from = list.len();
    let mut entry = |name, key, action, help| add(list, Edit, name, key, action, help);
    let new = |new| Action::Charting(Charting::Add(new));
    let help = "A photographic grey card in the photographs, of 18 %";
    entry("Add grey card", None, new(NewChart::Grey), help);
    let help = "A white tile or paper of known reflectance in the photographs";
    entry("Add white tile", None, new(NewChart::White), help);
    let help = "A ColorChecker Classic in the photographs: its grey patches settle the scale";
    entry("Add ColorChecker", None, new(NewChart::ColorChecker), help);
    let help = "A chart whose reflectances a CSV file has";
    entry("Add chart of a table…", None, Action::Ask(PathRequest::AddChartTable), help);
    let help = "Click the four corners of the selected chart over the photograph, or drag them";
    entry(
        "Place corners of chart",
        key(Modifiers::SHIFT, Key::C),
        Action::Charting(Charting::Tool(true)),
        help,
    );
    let help = "Clicks and drags in the 3D view select again";
    entry("Lay corner tool down", None, Action::Charting(Charting::Tool(false)), help);
    let help = "Take the selected chart away, with its surfaces and materials";
    entry("Remove chart", None, Action::Charting(Charting::Remove), help);
    put_within(list, from, "Charts");
}

pub(super) fn masks(list: &mut Vec<Command>) {
    use Menu::Edit;
    let from = list.len();
    let mut entry = |name, key, what, help| add(list, Edit, name, key, Action::Masking(what), help);
    let tool = |tool| Masking::Tool(Some(tool));
    entry(
        "Paint mask",
        key(Modifiers::SHIFT, Key::P),
        tool(MaskTool::Brush),
        MaskTool::Brush.help(),
    );
    entry("Draw mask with lasso", None, tool(MaskTool::Lasso), MaskTool::Lasso.help());
    entry("Draw mask with box", None, tool(MaskTool::Box), MaskTool::Box.help());
    entry("Mask surface", None, tool(MaskTool::Surface), MaskTool::Surface.help());
    let help = "Clicks and drags in the 3D view select again";
    entry("Lay mask tool down", None, Masking::Tool(None), help);
    let help = "Find unmodelled things in front of the known surfaces, where photographs disagree";
    entry("Suggest masks", None, Masking::Suggest, help);
    let help = "Unmask all pixels of the photograph in view, or of the selected one";
    entry("Clear mask", None, Masking::Clear, help);
    let help = "Exchange pixels of that photograph that are kept and pixels that are left out";
    entry("Invert mask", key(COMMAND | Modifiers::SHIFT, Key::M), Masking::Invert, help);
    put_within(list, from, "Masks");
}
