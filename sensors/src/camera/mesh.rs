//! Triangle meshes of bodies, and the few solids that they are composed of.
//!
//! Every solid is convex: a comparison with its centre orients its faces outwards. Coordinates are
//! in the frame of the body: for a vehicle x forward, y left, z up, with the origin on the ground
//! below the centre of its box.

pub(crate) type Vec3 = [f32; 3];

/// Returns one value for each of three axes or colours. Unlike `map` on an array, it is always
/// inlined.
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

/// The pattern drawn onto a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Texture {
    /// A uniform colour.
    Plain,
    /// A licence plate: dark glyphs on white.
    Plate,
    /// A radiator grille with horizontal bars.
    Grille,
    /// The tarpaulin or box of a trailer, with ribs and lettering.
    Panel,
    /// A window through which the interior is visible, darker towards the bottom.
    Glass,
}

/// The light that a face emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emission {
    /// No light.
    None,
    /// A headlamp seen from the front: dipped beam, or daytime running light.
    Headlamp,
    /// A small amber lamp, on at dusk and at night.
    Marker,
    /// A direction indicator, which shines during the bright phase of its blinking. `true` if it is
    /// on the vehicle's left side.
    Indicator(bool),
}

/// The appearance of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surface {
    /// Diffuse reflectance of linear red, green and blue (0 to 1).
    pub(crate) albedo: Vec3,
    /// Reflectance of the clear coat at grazing incidence: 0 is matt, 1 is polished.
    pub(crate) gloss: f32,
    /// The light that the face emits.
    pub(crate) emission: Emission,
    /// The pattern drawn onto the face.
    pub(crate) texture: Texture,
}

impl Surface {
    /// Returns a surface of uniform colour that emits no light.
    pub(crate) const fn plain(albedo: Vec3, gloss: f32) -> Self {
        Self { albedo, gloss, emission: Emission::None, texture: Texture::Plain }
    }

    /// Returns the same surface with a texture.
    pub(crate) const fn with_texture(self, texture: Texture) -> Self {
        Self { texture, ..self }
    }

    /// Returns the same surface with an emission.
    pub(crate) const fn with_emission(self, emission: Emission) -> Self {
        Self { emission, ..self }
    }

    const RUBBER: Self = Self::plain([0.02, 0.02, 0.02], 0.1);
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
    /// Indices of the corners in [`Mesh::vertices`], counter-clockwise as seen from outside.
    pub(crate) corners: [u16; 3],
    /// Appearance of the face.
    pub(crate) surface: Surface,
    /// Index in [`Mesh::maps`], used for textures other than [`Texture::Plain`].
    pub(crate) map: u16,
}

/// Texture coordinates as linear functions of the position p: u = (p − origin)·u_axis, and likewise
/// v. Both range from 0 to 1 across the face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureMap {
    pub(crate) origin: Vec3,
    pub(crate) u_axis: Vec3,
    pub(crate) v_axis: Vec3,
}

/// A lamp, recorded for the glow that surrounds it in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lamp {
    pub(crate) at: Vec3,
    pub(crate) emission: Emission,
}

/// A corner of a prism's outline: longitudinal position, height, and half the width of the prism
/// there (m).
pub(crate) type Rib = [f32; 3];

/// A body as a mesh of flat triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) faces: Vec<Face>,
    pub(crate) maps: Vec<TextureMap>,
    pub(crate) lamps: Vec<Lamp>,
}

/// Number of corners of a prism's outline, at most.
const MAX_RIBS: usize = 8;

impl Mesh {
    /// Removes everything but keeps the allocated memory.
    pub(crate) fn clear(&mut self) {
        self.vertices.clear();
        self.faces.clear();
        self.maps.clear();
        self.lamps.clear();
    }

    fn vertex(&mut self, at: Vec3) -> u16 {
        self.vertices.push(at);
        u16::try_from(self.vertices.len() - 1).unwrap_or(u16::MAX)
    }

    /// Adds a flat convex polygon, oriented so that it faces away from the point `inside`.
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

    /// Adds a prism that is symmetric about y = `centre_y`. Its outline is convex in the x–z plane,
    /// and each corner of the outline has its own half width. There are at most eight.
    pub(crate) fn prism(&mut self, ribs: &[Rib], centre_y: f32, surface: Surface) {
        let count = ribs.len() as f32;
        let mean = |part: usize| ribs.iter().map(|rib| rib[part]).sum::<f32>() / count;
        let inside = [mean(0), centre_y, mean(1)];
        let side = |sign: f32| move |rib: &Rib| [rib[0], centre_y + sign * rib[2], rib[1]];
        for sign in [-1.0, 1.0] {
            let mut outline = [[0.0; 3]; MAX_RIBS];
            outline.iter_mut().zip(ribs).for_each(|(corner, rib)| *corner = side(sign)(rib));
            self.polygon(&outline[..ribs.len()], inside, surface);
        }
        for (index, a) in ribs.iter().enumerate() {
            let b = &ribs[(index + 1) % ribs.len()];
            self.polygon(&[side(-1.0)(a), side(1.0)(a), side(1.0)(b), side(-1.0)(b)], inside, surface);
        }
    }

    /// Adds a box around `centre` with the half extents `half`.
    pub(crate) fn block(&mut self, centre: Vec3, half: Vec3, surface: Surface) {
        let [x, y, z] = centre;
        let rib = |sx: f32, sz: f32| [x + sx * half[0], z + sz * half[2], half[1]];
        self.prism(&[rib(1.0, -1.0), rib(1.0, 1.0), rib(-1.0, 1.0), rib(-1.0, -1.0)], y, surface);
    }

    /// Adds a wheel: an octagonal prism that stands on the ground, with its axis along y.
    pub(crate) fn wheel(&mut self, [x, y, radius]: Vec3, half_width: f32) {
        const RIM: [(f32, f32); 4] = [(0.92, 0.38), (0.38, 0.92), (-0.38, 0.92), (-0.92, 0.38)];
        let ribs: [Rib; 2 * RIM.len()] = std::array::from_fn(|index| {
            let (a, b) = RIM[index % RIM.len()];
            let (a, b) = if index < RIM.len() { (a, b) } else { (-a, -b) };
            [x + a * radius, radius + b * radius, half_width]
        });
        self.prism(&ribs, y, Surface::RUBBER);
    }

    /// Adds an ellipsoid with these `radii`, approximated by three rings of six faces and a lid.
    pub(crate) fn ellipsoid(&mut self, centre: Vec3, radii: Vec3, surface: Surface) {
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
        let lid: [Vec3; SECTORS.len()] = std::array::from_fn(|sector| at(sector, RINGS[3]));
        self.polygon(&lid, centre, surface);
    }

    /// Adds a quadrangle on top of a face. Its corners are bottom left, bottom right, top right and
    /// top left, as seen from outside. It is raised slightly above the face and shrunk towards its
    /// centre by the share `inset`.
    pub(crate) fn decal(&mut self, corners: [Vec3; 4], inset: f32, surface: Surface) {
        /// Height above the face (m), sufficient for the decal not to be hidden by the face at any
        /// distance.
        const LIFT_M: f32 = 0.012;
        let normal = normalised(cross(sub(corners[1], corners[0]), sub(corners[3], corners[0])));
        let centre = [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f32>() / 4.0);
        let corners = corners.map(|corner| {
            let shrunk = add_scaled(corner, sub(centre, corner), inset);
            add_scaled(shrunk, normal, LIFT_M)
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

    /// Adds a decal that faces forward on a plane of constant `x`. Its centre and its half extents
    /// are given as (y, z).
    pub(crate) fn front_decal(&mut self, x: f32, [y, z]: [f32; 2], [half_y, half_z]: [f32; 2], surface: Surface) {
        // Seen from the front, the vehicle's left (+y) is on the right.
        let corners =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| [x, y + a * half_y, z + b * half_z]);
        self.decal(corners, 0.0, surface);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the volume that the faces enclose, which is positive if they all face outwards.
    fn volume(mesh: &Mesh) -> f32 {
        let corner = |face: &Face, index: usize| mesh.vertices[usize::from(face.corners[index])];
        mesh.faces.iter().map(|f| dot(corner(f, 0), cross(corner(f, 1), corner(f, 2)))).sum::<f32>() / 6.0
    }

    #[test]
    fn solids_are_closed_and_their_faces_point_outwards() {
        let mut block = Mesh::default();
        block.block([3.0, -2.0, 1.0], [0.5, 1.0, 2.0], Surface::METAL);
        assert!((volume(&block) - 8.0).abs() < 1e-4);
        let mut ellipsoid = Mesh::default();
        ellipsoid.ellipsoid([0.0; 3], [1.0; 3], Surface::METAL);
        assert!((1.5..4.2).contains(&volume(&ellipsoid)), "{}", volume(&ellipsoid));
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
