//! What the film does with samples: words of the settings that concern it.

use super::record::choice;

choice! {
    /// How linear values of any size become values that a screen can show, 0 to 1. Each is applied after `exposure` and
    /// before `transfer`, and only to pictures for the screen: EXR files hold the linear values.
    pub enum ToneMap {
        /// Cut off at 1.
        Clip,
        /// Reinhard, Stark, Shirley and Ferwerda (SIGGRAPH 2002), equation 3, on the luminance: L / (1 + L). Colours
        /// keep their ratios; a channel that still is above 1 is cut off.
        Reinhard,
        /// Stephen Hill's fit of the reference and output transforms of ACES 1.0, with its saturating matrices.
        Aces,
        /// Troy Sobotka's AgX as Benjamin Wrensch has fitted it: sRGB primaries, a sixth-order polynomial for the base
        /// contrast, no look. Bright colours fade to white. Blender's AgX has another inset, of Rec. 2020 primaries, and
        /// tables in place of the polynomial: greys agree within 2 of 255, pure colours do not (a green of 1 by 55).
        AgX,
        /// The Khronos PBR Neutral tone mapper (2024): colours below 0.8 keep hue and saturation, brighter ones are
        /// compressed.
        Neutral,
    }
}

choice! {
    /// How samples around a pixel's centre count towards it (pbrt-v4, section 8.8). Each filter is a product of one
    /// function of x and the same of y.
    pub enum Filter {
        /// All alike: the mean over the pixel.
        Box,
        /// Falls off linearly.
        Tent,
        /// Falls off as exp(-x^2 / 2 s^2), less its value at the edge; s is a sixth of the width.
        Gaussian,
        /// Mitchell and Netravali (SIGGRAPH 1988) with B = C = 1/3: sharpens a little, by lobes below zero.
        Mitchell,
        /// The four-term window of Harris (Proc. IEEE 1978): smooth, with hardly any ringing.
        BlackmanHarris,
    }
}

impl Filter {
    /// Full width in pixels where the scene does not say: the usual ones.
    pub fn usual_width(self) -> f64 {
        match self {
            Filter::Box => 1.0,
            Filter::Tent => 2.0,
            Filter::Gaussian | Filter::BlackmanHarris => 3.0,
            Filter::Mitchell => 4.0,
        }
    }

    /// Whether some samples count negatively.
    pub fn has_negative_lobes(self) -> bool {
        match self {
            Filter::Box | Filter::Tent | Filter::Gaussian | Filter::BlackmanHarris => false,
            Filter::Mitchell => true,
        }
    }
}

choice! {
    /// A layer beside the colours of an EXR file: what the camera's rays met first.
    pub enum Aov {
        /// `Z`: distance along the view axis in world units, mean over the samples that met something; 1e10 where none
        /// did.
        Depth,
        /// `N.X N.Y N.Z`: shading normal in world space, towards the camera, mean over all samples; a sample that met
        /// nothing counts as zero.
        Normal,
        /// `albedo.R albedo.G albedo.B`: diffuse and mirror colour, white for what is clear; mean as for `Normal`.
        Albedo,
        /// `P.X P.Y P.Z`: point in world space, mean as for `Depth`; zero where no sample met anything.
        Position,
        /// `entityId`: number in authored order, from 1, of the entity that the sample nearest to the pixel's centre
        /// met; 0 if it met none.
        Entity,
        /// `materialId`: number of the material, as for `Entity`; the default material comes after the authored ones.
        Material,
        /// `motion.X motion.Y`: how far the surface has come in the picture since the frame before, in pixels to the right
        /// and up (as from an origin at the bottom left): its place now less its place then, of the sample nearest to the
        /// pixel's centre, not averaged; add it to a pixel's place in the frame before to get here. It counts the pose and
        /// field of view of the camera and the transforms of what was met, its parents and its `motion`, each moment of
        /// an open shutter against the same moment of the shutter one frame earlier; not changes of a shape's own numbers
        /// or what mirrors show. What was not there before counts as having stood where it stands. Zero where
        /// nothing was met, for what was behind the camera, and in a frame without one before it: the first of a clip (the
        /// first of a loop follows the last) and a scene without a script. A cut inside a sequence is a motion like any.
        Motion,
        /// `variance`: estimated variance of the pixel's luminance, from its samples before tone mapping and denoising.
        Variance,
    }
}
