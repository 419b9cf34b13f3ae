//! Charts in the window: they are added, their corners are placed over photographs, and threads find
//! where they are.

use glam::DVec2;

use super::actions::{Charting, NewChart};
use super::change::Change;
use super::changing;
use super::jobs::Found;
use super::masking::look_through_any;
use super::panes::Pane;
use super::project::Project;
use super::relight::free_name;
use super::reopening;
use super::state::State;
use crate::io::tags::charts::{GREY, card_sd};
use crate::math::rgb::Rgb;
use crate::scene::charts::{Chart, ChartKind, ChartView, Table};

/// A white tile is this bright until somebody says otherwise.
const WHITE: Rgb = [0.9; 3];

pub fn apply(state: &mut State, what: Charting) {
    match what {
        Charting::Add(new) => {
            let card = |kind, rgb| (kind, Table::card(rgb, card_sd(rgb)));
            let (kind, table) = match new {
                NewChart::Grey => card(ChartKind::Grey, GREY),
                NewChart::White => card(ChartKind::White, WHITE),
                NewChart::ColorChecker => (ChartKind::ColorChecker, Table::color_checker()),
            };
            add(state, kind, table);
        }
        Charting::AddTable(file) => {
            let ctx = state.ctx.clone();
            state.jobs.charts.read_table(&ctx, file);
        }
        Charting::Select(chart) => {
            if let Some(project) = &mut state.project {
                project.selection.chart = Some(chart);
                take_up(state, true);
            }
        }
        Charting::Tool(is_active) => take_up(state, is_active),
        Charting::Corners { photograph, corners_px } => {
            change(state, "corners of chart", |chart| put_corners(chart, photograph, corners_px));
        }
        Charting::RemoveCorners { photograph } => {
            change(state, "remove corners of chart", |chart| {
                chart.views.retain(|view| view.photograph != photograph);
            });
        }
        Charting::Change { name, chart: new } => change(state, name, |chart| *chart = *new),
        Charting::Remove => {
            let Some((mut charts, selected)) = selected(state) else { return };
            charts.remove(selected);
            propose(state, "remove chart", charts);
        }
        Charting::Matrix(correction) => {
            if let Some(project) = &state.project {
                let ctx = state.ctx.clone();
                state.jobs.charts.write_matrix(&ctx, project, correction);
            }
        }
    }
}

/// The kind of a chart for a person.
pub fn kind_name(chart: &Chart) -> &'static str {
    match chart.kind {
        ChartKind::Grey => "grey card",
        ChartKind::White => "white tile",
        ChartKind::ColorChecker => "ColorChecker",
        ChartKind::Table(_) => "chart of a table",
    }
}

/// Takes what threads have found.
pub fn follow(state: &mut State) {
    let Some(project) = &state.project else { return };
    let selected = project.selection.chart;
    if let Some(found) = state.jobs.charts.placed(project) {
        // Corners that are missing need no message: the panel asks for them.
        let problem = selected
            .and_then(|chart| found.charts.get(chart))
            .filter(|own| !own.chart.views.is_empty())
            .and_then(|own| Some((own.chart.name.clone(), own.placed.as_ref().err()?.clone())));
        if let Some((name, problem)) = problem {
            state.messages.notice(format!("{name} pins nothing: {problem}."));
        }
        take(state, found);
    }
    match state.jobs.charts.table() {
        Some(Ok((kind, table))) => add(state, kind, table),
        Some(Err(text)) => state.messages.error("This table cannot be used", text),
        None => {}
    }
    match state.jobs.charts.matrix() {
        Some(Ok(())) => {
            if let Some(folder) = state.project.as_ref().map(|project| project.folder.clone()) {
                reopening::reopen(state, &folder);
            }
        }
        Some(Err(text)) => state.messages.error("The colour matrix cannot be written", text),
        None => {}
    }
    if let Some(project) = &state.project {
        let ctx = state.ctx.clone();
        state.jobs.charts.follow_reading(&ctx, project);
    }
}

/// Adds a chart whose corners are then placed.
fn add(state: &mut State, kind: ChartKind, table: Table) {
    let Some(project) = &state.project else { return };
    let mut charts = wanted(state, project);
    let base = if table.is_card() { "card" } else { "chart" };
    let capture = &project.loaded;
    let surfaces = capture.surfaces.iter().map(|own| own.name.as_str());
    let materials = project.edit().materials.iter().map(|own| own.name.as_str());
    let names = charts.iter().map(|own| own.name.as_str());
    let name = free_name(base, surfaces.chain(materials).chain(names));
    let last = charts.len();
    charts.push(Chart { name, kind, table, views: Vec::new(), size_m: None });
    propose(state, "add chart", charts);
    if let Some(project) = &mut state.project {
        project.selection.chart = Some(last);
    }
    take_up(state, true);
}

/// The tool is for the photograph that is looked through; the selected one where none is.
fn take_up(state: &mut State, is_active: bool) {
    if state.project.is_none() {
        return;
    }
    state.viewport.cornering.is_active = is_active;
    if is_active {
        state.viewport.masking.tool = None;
        state.layout.show(Pane::Charts);
        look_through_any(state);
    }
}

fn put_corners(chart: &mut Chart, photograph: usize, corners_px: [DVec2; 4]) {
    match chart.views.iter_mut().find(|view| view.photograph == photograph) {
        Some(view) => view.corners_px = corners_px,
        None => chart.views.push(ChartView { photograph, corners_px }),
    }
}

fn wanted(state: &State, project: &Project) -> Vec<Chart> {
    state.jobs.charts.wanted(project).iter().map(|own| own.chart.clone()).collect()
}

/// All charts, and which is selected.
fn selected(state: &State) -> Option<(Vec<Chart>, usize)> {
    let project = state.project.as_ref()?;
    let charts = wanted(state, project);
    let selected = project.selection.chart.filter(|&chart| chart < charts.len())?;
    Some((charts, selected))
}

/// Changes the selected chart.
fn change(state: &mut State, name: &'static str, change: impl FnOnce(&mut Chart)) {
    let Some((mut charts, selected)) = selected(state) else { return };
    change(&mut charts[selected]);
    propose(state, name, charts);
}

/// Has the positions found that are not known yet, and then takes the charts.
fn propose(state: &mut State, name: &'static str, charts: Vec<Chart>) {
    let Some(project) = &state.project else { return };
    let ctx = state.ctx.clone();
    if let Some(found) = state.jobs.charts.place(&ctx, project, name, charts) {
        take(state, found);
    }
}

/// Makes charts whose positions are known the present ones, in a step that can be undone.
fn take(state: &mut State, found: Found) {
    let change = Change::Charts { name: found.name, charts: found.charts };
    changing::change_project(state, &change);
}
