//! The way from radiance to a colour on screen, as `display` of `common.wgsl` has it, for pictures
//! that are written.

use std::sync::Arc;

use super::content::ToneMapping;
use super::neutral::neutral;
use super::palette;
use crate::io::export::pictures::Development;
use crate::math::rgb::{Radiance, luminance, srgb_code};

/// Develops radiance as the 3D view shows it; `exposure` brings it to the screen's 0 to 1.
pub fn development(exposure: f32, tone: ToneMapping) -> Development {
    Development::By(Arc::new(move |radiance| display(radiance.map(|v| v * exposure), tone)))
}

fn display(exposed: Radiance, tone: ToneMapping) -> [u8; 3] {
    let exposed = exposed.map(|value| value.max(0.0));
    match tone {
        ToneMapping::Linear => exposed.map(srgb_code),
        ToneMapping::Neutral => neutral(exposed).map(srgb_code),
        ToneMapping::FalseColor => {
            let stops = (luminance(exposed) as f32).max(1e-12).log2();
            let color = palette::magnitude((stops + 8.0) / 10.0);
            [color.r(), color.g(), color.b()]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tone_has_its_ends() {
        let grey = |value: f32, tone| display([value; 3], tone)[1];
        assert_eq!([0.0, 1.0, 3.0].map(|v| grey(v, ToneMapping::Linear)), [0, 255, 255]);
        assert_eq!([0.0, 64.0].map(|v| grey(v, ToneMapping::Neutral)), [0, 255]);
        // Ten stops: from 8 below white to 2 above it.
        let (low, high) = (palette::magnitude(0.0), palette::magnitude(1.0));
        assert_eq!(display([0.5f32.powi(8); 3], ToneMapping::FalseColor)[0], low.r());
        assert_eq!(display([4.0; 3], ToneMapping::FalseColor)[0], high.r());
    }
}
