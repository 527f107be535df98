//! The rendering of an exposure's pixels.
//!
//! Each pixel is a function of (scene, pixel, key) alone, and does not depend on what was rendered
//! before.

use wide::f32x4;

use super::Frame;
use super::background::Background;
use super::body::{MOMENTS, texture_factor};
use super::bounds::{Bounds, touches};
use super::effects::keep;
use super::glow::{self};
use super::ground::GROUND_TO_M;
use super::ground::GroundLight;
use super::image::{CHANNELS, Crop, Image, LabelledImage, sample_positions};
use super::lanes::{mean, through_air};
use super::line::Line;
use super::mesh::{Texture, Vec3, dot, each};
use super::picture::{PixelRect, Resolution};
use super::raster::Lattice;
use super::sky;

impl Frame {
    /// Renders the whole image with the instance number of each pixel.
    pub fn image(&mut self) -> LabelledImage {
        let Resolution { width_px, height_px } = self.lens.image;
        let [columns, rows] = [width_px, height_px].map(|extent| (0..i32::from(extent)).collect::<Vec<i32>>());
        self.sampled(&columns, &rows)
    }

    /// Renders every `step`-th pixel of the rows `rows` of the image, as a small picture for human
    /// viewers. Each pixel is identical to the same pixel of the whole image.
    pub fn preview(&mut self, step: u16, rows: std::ops::Range<u16>) -> Image {
        let Resolution { width_px, height_px } = self.lens.image;
        let columns: Vec<i32> = (step / 2..width_px).step_by(step.into()).map(i32::from).collect();
        let rows: Vec<i32> =
            (rows.start + step / 2..rows.end.min(height_px)).step_by(step.into()).map(i32::from).collect();
        self.sampled(&columns, &rows).image
    }

    /// Renders the pixels at the intersections of `columns` and `rows`, in their order, with the
    /// instance number of each. Each pixel is identical to the same pixel of the whole image.
    pub fn sampled(&mut self, columns: &[i32], rows: &[i32]) -> LabelledImage {
        /// Side of the square tiles in which the picture is rendered (px), small enough for the
        /// processor's cache.
        const TILE: usize = 64;
        let width = columns.len();
        let mut rgb = vec![0; width * rows.len() * CHANNELS];
        let mut instances = vec![0; width * rows.len()];
        let mut tile = Vec::new();
        for (upper, some_rows) in rows.chunks(TILE).enumerate() {
            for (before, some) in columns.chunks(TILE).enumerate() {
                tile.resize(some_rows.len() * some.len() * CHANNELS, 0);
                self.draw(some, some_rows, &mut tile);
                for (row, line) in tile.chunks_exact(some.len() * CHANNELS).enumerate() {
                    let at = (upper * TILE + row) * width + before * TILE;
                    rgb[at * CHANNELS..at * CHANNELS + line.len()].copy_from_slice(line);
                    for column in 0..some.len() {
                        instances[at + column] = self.instance(row * some.len() + column);
                    }
                }
            }
        }
        let [width, height] = [width, rows.len()].map(|count| u32::try_from(count).unwrap_or(0));
        LabelledImage { image: Image { width, height, rgb }, instances }
    }

    /// Renders the classifier's crop of a square window.
    pub fn crop(&mut self, window: PixelRect, crop: &mut Crop) {
        let columns = sample_positions(window.left, window.width);
        let rows = sample_positions(window.top, window.height);
        crop.window = window;
        self.draw(&columns, &rows, &mut crop.rgb);
        let Resolution { width_px, height_px } = self.lens.image;
        let is_inside = |position: i32, limit: u16| (0..i32::from(limit)).contains(&position);
        for (pixel, rgb) in crop.rgb.chunks_exact_mut(CHANNELS).enumerate() {
            let (column, row) = (columns[pixel % columns.len()], rows[pixel / columns.len()]);
            if !(is_inside(column, width_px) && is_inside(row, height_px)) {
                rgb.fill(0);
            }
        }
    }

    /// Returns the share of the latest crop's samples that show the vehicle with the index `other`
    /// in the scene's list of other vehicles.
    pub fn instance_share(&self, other: usize) -> f64 {
        let samples = self.lists.visibility.face.len();
        let hits = (0..samples).filter(|sample| usize::from(self.instance(*sample)) == other + 1).count();
        hits as f64 / samples.max(1) as f64
    }

    /// Returns the instance number that a sample of the latest rendering shows, or 0 if it shows no
    /// vehicle.
    fn instance(&self, sample: usize) -> u16 {
        let face = self.lists.visibility.face[sample][0] as usize;
        self.lists.faces.get(face).map_or(0, |shade| shade.instance)
    }

    /// Renders the pixels at the intersections of `columns` and `rows`.
    fn draw(&mut self, columns: &[i32], rows: &[i32], rgb: &mut [u8]) {
        let (Some(left), Some(right), Some(top), Some(bottom)) =
            (columns.first(), columns.last(), rows.first(), rows.last())
        else {
            return;
        };
        let bounds = [*left as f32, *top as f32, *right as f32 + 1.0, *bottom as f32 + 1.0];
        self.lists.visibility.clear(columns.len() * rows.len());
        for moment in 0..MOMENTS {
            let lattice = Lattice { columns, rows, subpixel: self.subpixel[moment] };
            for object in self.lists.objects.iter().filter(|object| touches(&object.bounds, &bounds)) {
                let triangles = &self.lists.triangles[moment][object.triangles[moment].clone()];
                self.lists.visibility.draw(moment, triangles, &lattice);
            }
        }
        let mut of_tile = std::mem::take(&mut self.lists.effects);
        keep(&mut of_tile.patches, &self.lists.patches, &bounds);
        keep(&mut of_tile.clouds, &self.lists.clouds, &bounds);
        keep(&mut of_tile.glows, &self.lists.glows, &bounds);
        let memory = std::mem::take(&mut self.lists.line);
        let mut line = Line::new(self, columns, memory);
        let width = columns.len();
        for (index, (row, out)) in rows.iter().zip(rgb.chunks_exact_mut(width * CHANNELS)).enumerate() {
            line.begin(self, *row, &of_tile);
            for (place, out) in out.chunks_exact_mut(CHANNELS).enumerate() {
                out.copy_from_slice(&self.pixel(index * width + place, place, &mut line));
            }
        }
        self.lists.line = line.into_memory();
        self.lists.effects = of_tile;
    }

    /// Renders one pixel of a row. `sample` is its index in the lattice, and `place` that in the
    /// row.
    fn pixel(&self, sample: usize, place: usize, line: &mut Line<'_>) -> [u8; 3] {
        let pixel = [line.columns[place], line.row];
        let left_px = pixel[0] as f32;
        let (centre, length) = line.centre(self, place);
        let (mut light, nearness) = match self.at_once(sample, place, length, line) {
            Some(colour) => colour,
            None => self.moment_by_moment(sample, place, length, line),
        };
        let reaches = |bounds_px: &Bounds| left_px <= bounds_px[2] && bounds_px[0] <= left_px + 1.0;
        let mut glare = [0.0; 3];
        let mut direction = [0.0; 3];
        if self.may_see_glare(centre, length) || !line.effects.clouds.is_empty() || !self.lists.veils.is_empty() {
            direction = self.lens.ray_in_ground(centre).map(|part| part / length);
            let mut thickness = 0.0;
            for (_, cloud) in line.effects.clouds.iter().filter(|(bounds_px, _)| reaches(bounds_px)) {
                thickness += cloud.optical_depth(direction, length * MOMENTS as f32 / nearness.max(1e-3));
            }
            if thickness > 0.0 {
                let left = 1.0 / (1.0 + thickness * (1.0 + 0.5 * thickness));
                let air = each(|i| 0.92 * self.light.ambient[i].max(self.light.horizon[i] * 0.8));
                light = each(|i| air[i] + (light[i] - air[i]) * left);
            }
            glare = glow::sun(direction, &self.light);
        }
        let at = [pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5];
        for (_, glow) in line.effects.glows.iter().filter(|(bounds_px, _)| reaches(bounds_px)) {
            glow.add_to(at, &mut light);
        }
        for veil in &self.lists.veils {
            veil.add_to(direction, &mut light);
        }
        let mut radiance = self.window.transmitted(pixel, each(|i| light[i] + glare[i]), &self.light);
        if self.lens.optics.vignetting > 0.0 {
            let kept = self.lens.optics.transmitted(length);
            radiance = radiance.map(|part| part * kept);
        }
        self.window.encode(pixel, radiance, &self.light)
    }

    /// Returns whether the sun can be so near to a ray in camera axes that its glare shows.
    #[inline]
    fn may_see_glare(&self, ray: [f32; 2], length: f32) -> bool {
        let towards_sun = dot(self.lens.ray_in_ground(ray), self.light.to_sun);
        self.light.sun[0] > 0.0 && towards_sun > glow::NO_GLARE_TO_COSINE * length
    }

    /// Returns the mean radiance of a pixel that shows nothing but bodies, or nothing but
    /// background of one kind, and the sum of 1/depth over its moments (1/m). Returns `None` for
    /// other pixels.
    #[inline]
    fn at_once(&self, sample: usize, place: usize, length: f32, line: &mut Line<'_>) -> Option<(Vec3, f32)> {
        let inverse_depth = f32x4::from(self.lists.visibility.inverse_depth[sample]);
        match inverse_depth.simd_gt(f32x4::splat(0.0)).to_bitmask() {
            0 => {}
            0b1111 => return Some(self.bodies(sample, place, inverse_depth, length, line)),
            _ => return None,
        }
        let x = (!matches!(line.background, Background::Mixed)).then(|| line.x(place))?;
        let lit =
            GroundLight { light: &self.light, patches: &line.effects.patches, left_px: line.columns[place] as f32 };
        self.background(&line.background, x, length, &lit, &mut line.background_noise)
    }

    /// Returns the mean radiance of a pixel that shows a body at each moment, and the sum of
    /// 1/depth over its moments (1/m).
    #[inline]
    fn bodies(&self, sample: usize, place: usize, inverse_depth: f32x4, length: f32, line: &Line<'_>) -> (Vec3, f32) {
        let depth = f32x4::splat(1.0) / inverse_depth;
        let depths = depth.to_array();
        let faces = self.lists.visibility.face[sample];
        let mut of_moments = [[0.0; MOMENTS]; 3];
        for moment in 0..MOMENTS {
            let radiance = self.of_face(faces[moment], place, moment, depths[moment], line);
            for (of_moments, part) in of_moments.iter_mut().zip(radiance) {
                of_moments[moment] = part;
            }
        }
        let seen = through_air(&self.light, of_moments.map(f32x4::from), depth * f32x4::splat(length));
        (mean(seen), inverse_depth.to_array().into_iter().fold(0.0, |sum, part| sum + part))
    }

    /// Returns the radiance of a face at this depth (m), before the air, in the sample of a moment
    /// at a place of the row.
    #[inline]
    fn of_face(&self, face: u32, place: usize, moment: usize, depth: f32, line: &Line<'_>) -> Vec3 {
        let shade = &self.lists.faces[face as usize];
        if shade.texture == Texture::Plain {
            return shade.radiance;
        }
        let ray = line.ray(self, place, moment);
        let at = [ray[0] * depth, ray[1] * depth, depth];
        let [u, v] = [0, 1].map(|axis| dot(shade.map[axis], at) + shade.offset[axis]);
        let factor = texture_factor(shade.texture, u, v);
        shade.radiance.map(|part| part * factor)
    }

    /// Returns the mean radiance of a pixel, and the sum of 1/depth over its moments (1/m).
    fn moment_by_moment(&self, sample: usize, place: usize, length: f32, line: &mut Line<'_>) -> (Vec3, f32) {
        let mut sum = [0.0; 3];
        let mut nearness = 0.0;
        for moment in 0..MOMENTS {
            let (radiance, inverse_depth) = self.sample((sample, place), moment, length, line);
            nearness += inverse_depth;
            for (sum, part) in sum.iter_mut().zip(radiance) {
                *sum += part;
            }
        }
        (sum.map(|part| part / MOMENTS as f32), nearness)
    }

    /// Returns the radiance that one sample sees, and 1/depth (1/m), which is 0 for the sky. The
    /// sample is given by its index in the lattice and in the row, and `length` is the length of
    /// the ray through the middle of the pixel.
    fn sample(&self, (sample, place): (usize, usize), moment: usize, length: f32, line: &mut Line<'_>) -> (Vec3, f32) {
        let inverse_depth = self.lists.visibility.inverse_depth[sample][moment];
        if inverse_depth > 0.0 {
            let depth = 1.0 / inverse_depth;
            let radiance = self.of_face(self.lists.visibility.face[sample][moment], place, moment, depth, line);
            return (self.through_air(radiance, depth * length), inverse_depth);
        }
        let ray = line.ray(self, place, moment);
        let [ahead, left, up] = self.lens.ray_in_level_axes(ray);
        let height = self.lens.height_m as f32;
        let slope = || up / (ahead * ahead + left * left).sqrt();
        if line.is_ground[moment] || slope() * GROUND_TO_M < -height {
            let depth = if line.is_ground[moment] { line.ground_depth_m[moment] } else { -height / up };
            let [x, y, _] = self.lens.ray_in_ground(ray);
            let at = [x * depth, y * depth];
            let lit =
                GroundLight { light: &self.light, patches: &line.effects.patches, left_px: line.columns[place] as f32 };
            let noise = &mut line.noise[moment].0;
            let radiance = self.ground.radiance(at, line.travelled_m[moment], &lit, noise);
            return (self.through_air(radiance, depth * length), 1.0 / depth);
        }
        let bearing = -left / ahead + self.bearing_rad;
        (sky::radiance(slope(), bearing, &self.light, &mut line.noise[moment].1), 0.0)
    }

    /// Returns the distance that the ego has moved when a row of the image is read, relative to the
    /// middle row (m).
    pub(super) fn travelled_at(&self, row: i32) -> f32 {
        (self.ego_speed_mps * self.lens.read_after_s(f64::from(row) + 0.5)) as f32
    }

    fn through_air(&self, radiance: Vec3, distance_m: f32) -> Vec3 {
        let left = self.light.transmission(distance_m);
        each(|i| self.light.horizon[i] + (radiance[i] - self.light.horizon[i]) * left)
    }
}

#[cfg(test)]
mod tests;
