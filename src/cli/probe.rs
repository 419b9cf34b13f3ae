//! `lobelia probe CAPTURE --image NAME --outline x,y x,y x,y --reflectance R --out probe.exr`.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::builder::ArgAction;
use clap::{Arg, ArgMatches, Command, value_parser};
use glam::DVec2;

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job, photographs};
use crate::io::{exr, picture};
use crate::math::latlong;
use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::scene::ball::{Ball, BallView, surroundings};
use crate::worker::{Command as Job, JobEvent, Worker};

/// Photographs of a ball that differ by more than this, as |ln|, are not of one light, or their
/// outlines are not of one ball.
const ODD_DIFFERENCE: f64 = 0.1;

pub(super) fn command(capture: Arg) -> Command {
    let value = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name(value).help(help)
    };
    Command::new("probe")
        .about("Read the light at a place from photographs of a mirror ball")
        .long_about(
            "Read the light at a place from photographs of a mirror ball, and write it as a light probe: \
             linear OpenEXR in latitude and longitude, z up, the left edge looking along +y, with a \
             channel \"seen\" that is 0 where no photograph shows the direction. Give --image and \
             --outline once for each photograph. What the ball shows is taken to be far away beside its \
             size.",
        )
        .arg(capture)
        .arg(
            value("image", "NAME", "A photograph of the ball, as file_path names it")
                .visible_alias("photograph")
                .action(ArgAction::Append)
                .required(true),
        )
        .arg(
            value("outline", "X,Y", "Three or more points on the ball's outline in that photograph")
                .long_help(
                    "Three or more points on the ball's outline in that photograph, well around it, in \
                     pixels from the top left corner",
                )
                .action(ArgAction::Append)
                .num_args(1..)
                .required(true),
        )
        .arg(
            value("reflectance", "R,G,B", "Reflectance of the ball, one number or three")
                .value_parser(parse_reflectance)
                .required(true),
        )
        .arg(
            value("radius", "METRES", "The ball's radius; its position is then printed for \
                 each photograph")
                .value_parser(value_parser!(f64)),
        )
        .arg(
            value("camera-angle", "DEGREES", "Angle around the direction of each camera in \
                 which the other photographs are used [default: 8]")
                .value_parser(value_parser!(f64)),
        )
        .arg(
            value("width", "PIXELS", "Width of the probe [default: 512]")
                .value_parser(value_parser!(u32).range(2..=8192)),
        )
        .arg(
            value("compare", "FILE", "A probe to compare with, such as that of lobelia export")
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(
            value("out", "FILE", "OpenEXR file to write")
                .value_parser(value_parser!(PathBuf))
                .required(true),
        )
        .arg(
            Arg::new("quiet")
                .long("quiet")
                .short('q')
                .help("Show no progress")
                .action(ArgAction::SetTrue),
        )
}

fn parse_reflectance(text: &str) -> Result<Rgb, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|own| own.trim().parse().ok()).collect();
    let rgb = match numbers.as_deref() {
        Some(&[grey]) => Some([grey; CHANNELS]),
        Some(&[r, g, b]) => Some([r, g, b]),
        _ => None,
    };
    rgb.filter(|rgb| rgb.iter().all(|own| *own > 0.0 && *own <= 1.0)).ok_or_else(|| {
        "write one number above 0 and up to 1, or three, for example 0.62,0.61,0.60".to_owned()
    })
}

/// The points of one `--outline`.
fn points(texts: &[&str]) -> Result<Vec<DVec2>, Ending> {
    let point = |text: &&str| {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|own| own.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[x, y]) if x.is_finite() && y.is_finite() => Ok(DVec2::new(x, y)),
            _ => Err(anyhow!("--outline: \"{text}\" is no position x,y in pixels").into()),
        }
    };
    texts.iter().map(point).collect()
}

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let folder = arguments::required_path(matches, "capture");
    let out = arguments::required_path(matches, "out");
    let balls = photographs::named(matches, "outline", "the outline of its ball", points)?;
    let given = matches.get_one::<Rgb>("reflectance").copied();
    let reflectance = given.ok_or_else(|| anyhow!("--reflectance is missing"))?;
    let number = |name: &str| matches.get_one::<f64>(name).copied();
    let radius = number("radius");
    if radius.is_some_and(|radius| !(radius.is_finite() && radius > 0.0)) {
        return Err(anyhow!("--radius: a radius is above 0 metres").into());
    }
    let camera_angle = number("camera-angle").unwrap_or(8.0);
    if !(0.0..90.0).contains(&camera_angle) {
        return Err(anyhow!("--camera-angle: from 0 to 90 degrees").into());
    }
    let compared = matches.get_one::<PathBuf>("compare").map(|file| picture::read(file));
    let compared = compared.transpose()?;
    job::catch_interrupts()?;
    let mut worker = Worker::start(|| ())?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let load = Job::Load { path: folder };
    let JobEvent::Loaded(capture) = job::wait(&mut worker, load, &mut display)? else {
        return Ok(());
    };
    display.clear();
    let mut views = Vec::new();
    for (name, outline) in &balls {
        let (photograph, image) = photographs::measured(&capture, name)?;
        let failed = |problem: String| anyhow!("{}: {problem}", photograph.name);
        let camera = &photograph.camera;
        let ball = Ball::fit(camera, outline).map_err(|own| failed(format!("the ball: {own}")))?;
        let wide = 2.0 * ball.half_angle.to_degrees();
        match radius.map(|radius| camera.position + ball.axis * radius / ball.half_angle.sin()) {
            Some(place) => say_line!(
                "{}: the ball covers {wide:.2}°, its middle is at {:.3}, {:.3}, {:.3} m",
                photograph.name,
                place.x,
                place.y,
                place.z
            ),
            None => say_line!("{}: the ball covers {wide:.2}°", photograph.name),
        }
        views.push(BallView { camera, image, ball });
    }
    let width = matches.get_one::<u32>("width").map_or(512, |width| *width as usize);
    let found = surroundings(&views, reflectance, camera_angle.to_radians(), width);
    let shown = found.shown();
    if shown == 0.0 {
        return Err(anyhow!(
            "no pixel of the ball is a measurement: look at the outline, the mask and the saturation"
        )
        .into());
    }
    let pixels: Vec<Radiance> =
        found.texels.iter().map(|texel| texel.unwrap_or([0.0; CHANNELS])).collect();
    let seen: Vec<f32> =
        found.texels.iter().map(|own| f32::from(u8::from(own.is_some()))).collect();
    exr::write_rgb_with(&out, found.width, found.height, &pixels, &[("seen", &seen)])?;
    say_line!("{}: {:.1} % of all directions are shown", out.display(), 100.0 * shown);
    if let Some(difference) = found.difference {
        say_line!("photographs of a direction differ by {:.1} %", 100.0 * difference.exp_m1());
        if difference > ODD_DIFFERENCE {
            note_line!(
                "warning: the photographs of the ball do not agree: they are not of one light or \
                 exposure, or an outline is not that of the ball."
            );
        }
    }
    if let Some(other) = compared {
        // By its pixels as they are: between them the other one would be smoothed.
        let compared = found.compare(|direction| {
            let (x, y) = latlong::cell(direction, (other.width, other.height));
            other.pixels[y * other.width + x]
        });
        let compared = compared.ok_or_else(|| anyhow!("--compare: the probe there is black"))?;
        say_line!(
            "beside the other probe: {:.1} % of the directions are within 5 %, the ratio is {:.3} in \
             the middle of them",
            100.0 * compared.within_5_percent,
            compared.ratio
        );
    }
    Ok(())
}
