//! Bodies as flat triangles, and the few solids that they are put together from.
//!
//! Every solid is convex, so that its faces can be turned outwards by looking from its middle. Coordinates are those
//! of the body's own frame: for a vehicle x forward, y left, z up, origin on the ground below the box's centre.

pub(crate) type Vec3 = [f32; 3];

/// One value for each of three axes or colours. Unlike `map` on an array, it is always compiled in place.
#[inline]
pub(crate) fn each<T>(value: impl Fn(usize) -> T) -> [T; 3] {
    [value(0), value(1), value(2)]
}

#[inline]
pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(crate) fn dot(a: Vec3, b: Vec3) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
pub(crate) fn add_scaled(a: Vec3, b: Vec3, factor: f32) -> Vec3 {
    [a[0] + b[0] * factor, a[1] + b[1] * factor, a[2] + b[2] * factor]
}

#[inline]
pub(crate) fn normalised(a: Vec3) -> Vec3 {
    let length = dot(a, a).sqrt().max(f32::MIN_POSITIVE);
    a.map(|x| x / length)
}

/// What is drawn onto a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Texture {
    /// One colour.
    Plain,
    /// A licence plate: dark glyphs on white.
    Plate,
    /// A radiator grille: bars.
    Grille,
    /// A trailer's tarpaulin or box: ribs, and a sign.
    Panel,
    /// A windscreen: the interior shows, darker towards the bottom.
    Glass,
}

/// Light that a face gives off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emission {
    /// None.
    None,
    /// A headlamp seen from ahead: dipped beam, or daytime running light.
    Headlamp,
    /// A small amber lamp, on at dusk and at night.
    Marker,
    /// A direction indicator, on while it blinks to E's left (`true`: on the vehicle's left side).
    Indicator(bool),
}

/// How a face looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surface {
    /// Diffuse reflectance, linear red, green, blue [1].
    pub(crate) albedo: Vec3,
    /// Reflectance at grazing incidence of the clear layer on top [1]: 0 matt, 1 polished.
    pub(crate) gloss: f32,
    /// Its own light.
    pub(crate) emission: Emission,
    /// What is drawn onto it.
    pub(crate) texture: Texture,
}

impl Surface {
    /// A surface of one colour.
    pub(crate) const fn plain(albedo: Vec3, gloss: f32) -> Self {
        Self { albedo, gloss, emission: Emission::None, texture: Texture::Plain }
    }

    /// The same with something drawn onto it.
    pub(crate) const fn with_texture(self, texture: Texture) -> Self {
        Self { texture, ..self }
    }

    /// The same with light of its own.
    pub(crate) const fn with_emission(self, emission: Emission) -> Self {
        Self { emission, ..self }
    }

    pub(crate) const RUBBER: Self = Self::plain([0.02, 0.02, 0.02], 0.1);
    pub(crate) const PLASTIC: Self = Self::plain([0.035, 0.035, 0.037], 0.3);
    pub(crate) const METAL: Self = Self::plain([0.35, 0.36, 0.37], 0.5);
    pub(crate) const GLASS: Self = Self::plain([0.02, 0.025, 0.03], 1.0).with_texture(Texture::Glass);
    pub(crate) const GRILLE: Self = Self::plain([0.05, 0.05, 0.055], 0.4).with_texture(Texture::Grille);
    pub(crate) const PLATE: Self = Self::plain([0.75, 0.75, 0.72], 0.2).with_texture(Texture::Plate);
    pub(crate) const HEADLAMP: Self = Self::plain([0.55, 0.57, 0.6], 0.9).with_emission(Emission::Headlamp);
    pub(crate) const MARKER: Self = Self::plain([0.5, 0.3, 0.05], 0.4).with_emission(Emission::Marker);
}

/// A triangle of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Its corners: places in the list of vertices; counter-clockwise seen from outside.
    pub(crate) corners: [u16; 3],
    /// How it looks.
    pub(crate) surface: Surface,
    /// Place in the list of texture maps, for textures other than plain.
    pub(crate) map: u16,
}

/// Texture coordinates as linear functions of place: u = (p − origin)·u_axis, both 0 … 1 across the face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureMap {
    pub(crate) origin: Vec3,
    pub(crate) u_axis: Vec3,
    pub(crate) v_axis: Vec3,
}

/// A lamp, for the glow around it in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lamp {
    pub(crate) at: Vec3,
    pub(crate) emission: Emission,
}

/// A corner of a prism's outline: place along the body, height, and half the width there [m].
pub(crate) type Rib = [f32; 3];

/// A body of flat triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) faces: Vec<Face>,
    pub(crate) maps: Vec<TextureMap>,
    pub(crate) lamps: Vec<Lamp>,
}

impl Mesh {
    fn vertex(&mut self, at: Vec3) -> u16 {
        self.vertices.push(at);
        u16::try_from(self.vertices.len() - 1).unwrap_or(u16::MAX)
    }

    /// A flat convex polygon, turned so that it faces away from `inside`.
    fn polygon(&mut self, corners: &[Vec3], inside: Vec3, surface: Surface) {
        let normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
        let outwards = dot(normal, sub(corners[0], inside)) >= 0.0;
        let first = self.vertex(corners[0]);
        let mut last = self.vertex(corners[1]);
        for &corner in &corners[2..] {
            let next = self.vertex(corner);
            let corners = if outwards { [first, last, next] } else { [first, next, last] };
            self.faces.push(Face { corners, surface, map: 0 });
            last = next;
        }
    }

    /// A prism that is symmetric about y = `centre_y`: a convex outline in the x–z plane, each corner with its own
    /// half width.
    pub(crate) fn prism(&mut self, ribs: &[Rib], centre_y: f32, surface: Surface) {
        let count = ribs.len() as f32;
        let mean = |part: usize| ribs.iter().map(|rib| rib[part]).sum::<f32>() / count;
        let inside = [mean(0), centre_y, mean(1)];
        let side = |sign: f32| move |rib: &Rib| [rib[0], centre_y + sign * rib[2], rib[1]];
        for sign in [-1.0, 1.0] {
            let outline: Vec<Vec3> = ribs.iter().map(side(sign)).collect();
            self.polygon(&outline, inside, surface);
        }
        for (place, a) in ribs.iter().enumerate() {
            let b = &ribs[(place + 1) % ribs.len()];
            self.polygon(&[side(-1.0)(a), side(1.0)(a), side(1.0)(b), side(-1.0)(b)], inside, surface);
        }
    }

    /// A box of `half` extents around `centre`.
    pub(crate) fn block(&mut self, centre: Vec3, half: Vec3, surface: Surface) {
        let [x, y, z] = centre;
        let rib = |sx: f32, sz: f32| [x + sx * half[0], z + sz * half[2], half[1]];
        self.prism(&[rib(1.0, -1.0), rib(1.0, 1.0), rib(-1.0, 1.0), rib(-1.0, -1.0)], y, surface);
    }

    /// A wheel: eight-sided, its axis along y.
    pub(crate) fn wheel(&mut self, [x, y, radius]: Vec3, half_width: f32) {
        let rim = [(0.92, 0.38), (0.38, 0.92), (-0.38, 0.92), (-0.92, 0.38)];
        let round = rim.into_iter().chain(rim.into_iter().map(|(a, b)| (-a, -b)));
        let ribs: Vec<Rib> =
            round.map(|(a, b): (f32, f32)| [x + a * radius, radius + b * radius, half_width]).collect();
        self.prism(&ribs, y, Surface::RUBBER);
    }

    /// A ball, flattened or drawn out to `radii`: three rings of six faces.
    pub(crate) fn ball(&mut self, centre: Vec3, radii: Vec3, surface: Surface) {
        const SECTORS: [(f32, f32); 6] =
            [(1.0, 0.0), (0.5, 0.87), (-0.5, 0.87), (-1.0, 0.0), (-0.5, -0.87), (0.5, -0.87)];
        const RINGS: [(f32, f32); 4] = [(-1.0, 0.3), (-0.45, 0.93), (0.45, 0.93), (1.0, 0.3)];
        let at = |sector: usize, (up, out): (f32, f32)| {
            let (x, y) = SECTORS[sector % SECTORS.len()];
            let [rx, ry, rz] = radii;
            [centre[0] + rx * out * x, centre[1] + ry * out * y, centre[2] + rz * up]
        };
        for pair in RINGS.windows(2) {
            for sector in 0..SECTORS.len() {
                let corners =
                    [at(sector, pair[0]), at(sector + 1, pair[0]), at(sector + 1, pair[1]), at(sector, pair[1])];
                self.polygon(&corners, centre, surface);
            }
        }
        let lid: Vec<Vec3> = (0..SECTORS.len()).map(|sector| at(sector, RINGS[3])).collect();
        self.polygon(&lid, centre, surface);
    }

    /// A quadrangle laid onto a face: corners bottom left, bottom right, top right, top left as seen from outside.
    /// It is lifted off the face a little, and pulled in from the corners by the share `inset`.
    pub(crate) fn decal(&mut self, corners: [Vec3; 4], inset: f32, surface: Surface) {
        /// Far enough not to be hidden by what lies below at any distance [m].
        const LIFT_M: f32 = 0.012;
        let normal = normalised(cross(sub(corners[1], corners[0]), sub(corners[3], corners[0])));
        let centre = [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f32>() / 4.0);
        let corners = corners.map(|corner| {
            let pulled = add_scaled(corner, sub(centre, corner), inset);
            add_scaled(pulled, normal, LIFT_M)
        });
        let inside = add_scaled(centre, normal, -1.0);
        let first = self.faces.len();
        self.polygon(&corners, inside, surface);
        let axis = |to: Vec3| {
            let along = sub(to, corners[0]);
            along.map(|x| x / dot(along, along).max(f32::MIN_POSITIVE))
        };
        self.maps.push(TextureMap { origin: corners[0], u_axis: axis(corners[1]), v_axis: axis(corners[3]) });
        let map = u16::try_from(self.maps.len() - 1).unwrap_or(u16::MAX);
        for face in &mut self.faces[first..] {
            face.map = map;
        }
        if surface.emission != Emission::None {
            self.lamps.push(Lamp { at: centre, emission: surface.emission });
        }
    }

    /// A decal on a plane of constant x that faces forward: centre (y, z), half extents (y, z).
    pub(crate) fn front_decal(&mut self, x: f32, [y, z]: [f32; 2], [half_y, half_z]: [f32; 2], surface: Surface) {
        // Seen from ahead, the vehicle's left (+y) is on the right.
        let corners =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| [x, y + a * half_y, z + b * half_z]);
        self.decal(corners, 0.0, surface);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume that the faces enclose: positive where all are turned outwards.
    fn volume(mesh: &Mesh) -> f32 {
        let corner = |face: &Face, place: usize| mesh.vertices[usize::from(face.corners[place])];
        mesh.faces.iter().map(|f| dot(corner(f, 0), cross(corner(f, 1), corner(f, 2)))).sum::<f32>() / 6.0
    }

    #[test]
    fn solids_are_closed_and_turned_outwards() {
        let mut block = Mesh::default();
        block.block([3.0, -2.0, 1.0], [0.5, 1.0, 2.0], Surface::METAL);
        assert!((volume(&block) - 8.0).abs() < 1e-4);
        let mut ball = Mesh::default();
        ball.ball([0.0; 3], [1.0; 3], Surface::METAL);
        assert!((1.5..4.2).contains(&volume(&ball)), "{}", volume(&ball));
    }

    #[test]
    fn a_decal_on_the_front_faces_forward_and_spans_its_texture() {
        let mut mesh = Mesh::default();
        mesh.front_decal(2.0, [0.5, 1.0], [0.2, 0.1], Surface::PLATE);
        let face = mesh.faces[0];
        let [a, b, c] = face.corners.map(|corner| mesh.vertices[usize::from(corner)]);
        assert!(cross(sub(b, a), sub(c, a))[0] > 0.0);
        let map = mesh.maps[usize::from(face.map)];
        let from_origin = sub([2.0, 0.7, 1.1], map.origin);
        assert!((dot(from_origin, map.u_axis) - 1.0).abs() < 1e-4 && (dot(from_origin, map.v_axis) - 1.0).abs() < 1e-4);
    }
}
