//! The colours of the window: neutral greys, so that they do not affect how colours in pictures
//! look, and one accent.

use eframe::egui::{
    self, Color32, CornerRadius, FontFamily, FontId, Stroke, TextStyle, Theme, Visuals, vec2,
};

/// The accent: what is selected, runs or is to be pressed next. White on it is legible.
pub const ACCENT: Color32 = Color32::from_rgb(0x2B, 0x6C, 0xA3);

/// Red, green and blue as lines of a plot, told apart by any eye.
pub fn channel_color(channel: usize, dark: bool) -> Color32 {
    let [bright, deep] = match channel {
        0 => [0xE8794A, 0xC04A10],
        1 => [0x35BE97, 0x007F5C],
        _ => [0x64B5EE, 0x0064A4],
    };
    let [_, r, g, b] = u32::to_be_bytes(if dark { bright } else { deep });
    Color32::from_rgb(r, g, b)
}

pub const CHANNEL_NAMES: [&str; 3] = ["Red", "Green", "Blue"];

/// Sets fonts, spacing and both themes.
pub fn install(ctx: &egui::Context) {
    ctx.set_visuals_of(Theme::Dark, dark());
    ctx.set_visuals_of(Theme::Light, light());
    ctx.all_styles_mut(|style| {
        let fonts = [
            (TextStyle::Small, 12.0, FontFamily::Proportional),
            (TextStyle::Body, 13.0, FontFamily::Proportional),
            (TextStyle::Button, 13.0, FontFamily::Proportional),
            (TextStyle::Monospace, 12.0, FontFamily::Monospace),
            (TextStyle::Heading, 16.0, FontFamily::Proportional),
        ];
        style.text_styles = fonts
            .into_iter()
            .map(|(name, size, family)| (name, FontId::new(size, family)))
            .collect();
        style.spacing.item_spacing = vec2(8.0, 4.0);
        style.spacing.button_padding = vec2(8.0, 3.0);
        style.spacing.interact_size = vec2(36.0, 20.0);
        style.spacing.indent = 16.0;
        style.spacing.tooltip_width = 320.0;
        style.interaction.tooltip_delay = 0.4;
    });
}

/// Follows the settings' words.
pub fn apply(ctx: &egui::Context, theme: &str, scale: f32) {
    ctx.set_theme(match theme {
        "light" => egui::ThemePreference::Light,
        "system" => egui::ThemePreference::System,
        _ => egui::ThemePreference::Dark,
    });
    ctx.set_zoom_factor(scale);
}

fn dark() -> Visuals {
    let grey = Color32::from_gray;
    let mut visuals = Visuals::dark();
    visuals.panel_fill = grey(38);
    visuals.window_fill = grey(44);
    visuals.extreme_bg_color = grey(24);
    visuals.faint_bg_color = grey(44);
    visuals.code_bg_color = grey(30);
    visuals.weak_text_color = Some(grey(160));
    visuals.warn_fg_color = Color32::from_rgb(0xF0, 0xB0, 0x50);
    visuals.error_fg_color = Color32::from_rgb(0xFF, 0x8A, 0x80);
    visuals.hyperlink_color = Color32::from_rgb(0x7A, 0xB8, 0xEC);
    visuals.widgets.noninteractive.fg_stroke.color = grey(216);
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, grey(62));
    visuals.widgets.inactive.fg_stroke.color = grey(224);
    visuals.widgets.inactive.bg_fill = grey(66);
    visuals.widgets.inactive.weak_bg_fill = grey(60);
    visuals.widgets.hovered.weak_bg_fill = grey(76);
    visuals.widgets.hovered.bg_fill = grey(84);
    visuals.widgets.active.weak_bg_fill = grey(92);
    finish(visuals)
}

fn light() -> Visuals {
    let grey = Color32::from_gray;
    let mut visuals = Visuals::light();
    visuals.panel_fill = grey(238);
    visuals.window_fill = grey(246);
    visuals.extreme_bg_color = grey(254);
    visuals.faint_bg_color = grey(230);
    visuals.code_bg_color = grey(226);
    visuals.weak_text_color = Some(grey(90));
    visuals.warn_fg_color = Color32::from_rgb(0x8A, 0x50, 0x00);
    visuals.error_fg_color = Color32::from_rgb(0xB0, 0x1C, 0x1C);
    visuals.hyperlink_color = Color32::from_rgb(0x1C, 0x5A, 0x92);
    visuals.widgets.noninteractive.fg_stroke.color = grey(30);
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, grey(198));
    visuals.widgets.inactive.fg_stroke.color = grey(28);
    visuals.widgets.inactive.bg_fill = grey(208);
    visuals.widgets.inactive.weak_bg_fill = grey(218);
    visuals.widgets.hovered.weak_bg_fill = grey(206);
    visuals.widgets.active.weak_bg_fill = grey(194);
    finish(visuals)
}

fn finish(mut visuals: Visuals) -> Visuals {
    visuals.selection.bg_fill = ACCENT;
    visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
    let corner = CornerRadius::same(3);
    for widget in [
        &mut visuals.widgets.noninteractive,
        &mut visuals.widgets.inactive,
        &mut visuals.widgets.hovered,
        &mut visuals.widgets.active,
        &mut visuals.widgets.open,
    ] {
        widget.corner_radius = corner;
        widget.expansion = 0.0;
    }
    visuals.window_corner_radius = CornerRadius::same(4);
    visuals.menu_corner_radius = CornerRadius::same(4);
    visuals
}
