//! `lobelia score CAPTURE SOLUTION`.

use std::path::PathBuf;

use clap::ArgMatches;

use crate::cli::print::say_line;
use crate::cli::{Ending, arguments};
use crate::io::solution::{Solution, write_pretty};
use crate::io::truth::Truth;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::study::pictures::{self, PictureScore};
use crate::study::score::{Errors, Score, compare};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let capture = arguments::required_path(matches, "capture");
    let mut file = arguments::required_path(matches, "solution");
    if file.is_dir() {
        file.push("solution.json");
    }
    let solution = Solution::read(&file)?;
    let truth = Truth::read(&capture.join("truth.json"))?;
    let mut score = compare(&solution, &truth);
    let folders = ["renders", "truth_images"].map(|name| matches.get_one::<PathBuf>(name));
    if let [Some(renders), Some(truths)] = folders {
        score.pictures = pictures::compare_folders(renders, truths)?;
    }
    print(&score);
    if !score.pictures.is_empty() {
        print_pictures(&score.pictures);
    }
    if let Some(json) = matches.get_one::<PathBuf>("json") {
        write_pretty(json, &score)?;
    }
    Ok(())
}

fn print(score: &Score) {
    let widest = score.materials.iter().map(|m| m.name.chars().count()).max().unwrap_or(0).max(10);
    let heads = ["material", "estimated", "true", "in its interval"];
    say_line!("{:widest$}  {:24}{:24}{:17}samples", heads[0], heads[1], heads[2], heads[3]);
    for material in &score.materials {
        say_line!(
            "{:widest$}  {:24}{:24}{:17}{}",
            material.name,
            triple(material.estimated_diffuse),
            triple(material.true_diffuse),
            inside(material.diffuse_inside),
            material.samples
        );
        let specular = material.estimated_specular.filter(|s| s.iter().any(|&v| v > 0.0));
        if specular.is_some() || material.true_specular != [0.0; 3] {
            say_line!(
                "{:widest$}  {:24}{:24}{}",
                "  specular",
                triple(specular.unwrap_or_default()),
                triple(material.true_specular),
                inside(material.specular_inside),
            );
            let exponent = |n: Option<f64>| n.map_or("-".to_owned(), |n| format!("{n:.1}"));
            let interval = material.exponent_interval;
            let interval =
                interval.map_or(String::new(), |[low, high]| format!(" [{low:.1}, {high:.1}]"));
            say_line!(
                "{:widest$}  {:24}{:24}{}",
                "  exponent",
                exponent(material.estimated_exponent) + &interval,
                exponent(material.true_exponent),
                one_inside(material.exponent_inside),
            );
        }
    }
    for skipped in &score.skipped {
        say_line!("{:widest$}  not compared: {}", skipped.name, skipped.reason);
    }
    let line = |name: &str, errors: &Errors, scale: Option<Rgb>| {
        let specular = match errors.mean_specular.zip(errors.largest_specular) {
            Some((mean, largest)) => format!("; specular mean {mean:.4}, largest {largest:.4}"),
            None => String::new(),
        };
        let scale = scale.map_or(String::new(), |scale| format!("  (scale {})", triple(scale)));
        say_line!(
            "{name}: mean {:.4}, largest {:.4}{specular}{scale}",
            errors.mean_diffuse,
            errors.largest_diffuse
        );
    };
    say_line!("absolute error of the reflectances");
    match &score.raw {
        Some(errors) => line("  raw", errors, None),
        None => say_line!("  nothing could be compared"),
    }
    if let Some(scaled) = &score.common_scale {
        line("  after one common scale", &scaled.errors, Some(scaled.scale));
    }
    if let Some(scaled) = &score.channel_scale {
        line("  after a scale per channel", &scaled.errors, Some(scaled.scale));
    }
    let intervals = &score.intervals;
    match intervals.mean_half_width {
        None => say_line!("no intervals given"),
        Some(width) => say_line!(
            "true values in their intervals: {} of {} ({} have none); mean half-width {width:.4}",
            intervals.inside,
            intervals.of,
            intervals.without
        ),
    }
    if intervals.exponents_of > 0 {
        let (inside, of) = (intervals.exponents_inside, intervals.exponents_of);
        say_line!("true exponents in their intervals: {inside} of {of}");
    }
}

fn print_pictures(pictures: &[PictureScore]) {
    let widest = pictures.iter().map(|p| p.name.chars().count()).max().unwrap_or(0).max(10);
    say_line!("{:widest$}  {:>9}  relative RMS  PSNR in dB    FLIP  HDR-FLIP", "picture", "pixels");
    for picture in pictures {
        let psnr = picture.psnr_db.map_or("-".to_owned(), |psnr| format!("{psnr:.2}"));
        say_line!(
            "{:widest$}  {:>9}  {:>12.4}  {psnr:>10}  {:.4}    {:.4}",
            picture.name,
            picture.pixels,
            picture.relative_rms,
            picture.mean_flip,
            picture.mean_hdr_flip
        );
    }
}

fn inside(channels: [Option<bool>; CHANNELS]) -> String {
    channels.map(|channel| format!("{:4}", one_inside(channel))).join("")
}

fn one_inside(inside: Option<bool>) -> &'static str {
    match inside {
        Some(true) => "yes",
        Some(false) => "no",
        None => "-",
    }
}

fn triple([r, g, b]: Rgb) -> String {
    format!("{r:.3} {g:.3} {b:.3}")
}
