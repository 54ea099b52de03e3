// What the native renderer knows of a scene: plain data, filled in by bind/ and never
// changed.
#pragma once

#include "base/vec.h"
#include "kdtree/tree.h"
#include "objects/object_set.h"
#include "render/texture.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace mlrt {

inline constexpr uint32_t NONE = 0xffffffffu;

// A run of faces that share a material and an emitter: one Mitsuba shape. An analytic shape
// has one face.
struct Shape {
    uint32_t first_face = 0;
    uint32_t face_count = 0;
    uint32_t material = NONE;    // index into SceneData::materials
    uint32_t emitter = NONE;     // index into SceneData::emitters if the shape glows
    bool vertex_normals = false; // interpolate SceneData::normals, else the face normal
    bool flip_normals = false;
    bool texture_coordinates = false; // SceneData::uvs, else weights of the vertices
};

// Lambertian reflectance, a colour or a texture per side. A side that reflects nothing is
// black. Front is the side that the shading normal points to (Mitsuba: cos_theta > 0).
struct Material {
    Vec3f front{};
    Vec3f back{};
    // Indices into SceneData::textures: in place of the colours, and the share of the light
    // that is reflected at all (Mitsuba's `mask`).
    uint32_t front_texture = NONE, back_texture = NONE, opacity = NONE;
    bool passes = false; // all light goes straight through: Mitsuba's `null`
    // Indices into SceneData::speculars: sides that mirror and refract, and are black else.
    uint32_t front_specular = NONE, back_specular = NONE;
    bool delta = false; // neither side scatters, so that no light sample is taken

    bool is_textured() const {
        return front_texture != NONE || back_texture != NONE || opacity != NONE;
    }
};

enum class SpecularType : uint32_t { conductor, dielectric, thindielectric };

// A side of a surface that does not scatter what it mirrors and refracts.
struct Specular {
    SpecularType type = SpecularType::conductor;
    Vec3f reflectance{1, 1, 1}, transmittance{1, 1, 1}; // factors
    // Indices into SceneData::textures, in place of these.
    uint32_t reflectance_texture = NONE, transmittance_texture = NONE;
    Vec3f eta{}, k{}; // conductor: real and imaginary part of its index, by channel
    float ior = 1;    // others: index of the inside over that of the outside

    bool is_textured() const {
        return reflectance_texture != NONE || transmittance_texture != NONE;
    }
};

enum class EmitterType : uint32_t {
    point,
    spot,
    projector,
    directional,
    area,
    constant,
    envmap
};

// Whether the light comes from all around the scene; one emitter at most does.
constexpr bool is_environment(EmitterType type) {
    return type == EmitterType::constant || type == EmitterType::envmap;
}

// Whether all light comes from one point.
constexpr bool is_at_point(EmitterType type) {
    return type == EmitterType::point || type == EmitterType::spot ||
           type == EmitterType::projector;
}

// Whether the light comes to each point from one direction, which no ray meets by chance.
constexpr bool has_one_direction(EmitterType type) {
    return is_at_point(type) || type == EmitterType::directional;
}

// Light sources in the order of their declaration, which emitter sampling depends on.
struct Emitter {
    EmitterType type = EmitterType::point;
    Vec3f radiance{}; // intensity (point, spot), irradiance (directional), radiance (area,
                      // constant), factor of the picture (envmap, projector)
    Vec3f position{}; // point, spot, projector: world space
    Vec3f direction{0, 0,
                    1}; // spot: axis; directional: the way light travels; unit, world space
    float cutoff_angle = 0; // spot: radians, full cut-off measured from the axis
    float beam_width = 0;   // spot: radians, no fall-off inside
    uint32_t shape = NONE;  // area: the glowing shape
    // area, on a rectangle or an analytic shape: index into SceneData::textures, in place
    // of `radiance`; projector: the picture
    uint32_t radiance_texture = NONE;
    bool rectangle = false;             // area: `rectangle` samples uniformly in its (u, v)
    Vec3f corner{}, edge_u{}, edge_v{}; // rectangle: p = corner + u * edge_u + v * edge_v
    // envmap, projector: in world space; the latter shines along the third
    std::array<Vec3f, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Vec2f half_size{1, 1}; // projector: of its picture at distance 1
    // envmap: light samples leave out what is darker than the mean
    bool mis_compensation = false;
    float sampling_weight = 1; // relative probability of being chosen
};

// Radiance in latitude and longitude. The first row lies at the pole that the emitter's y
// axis points to.
struct EnvironmentPicture {
    uint32_t width = 0, height = 0; // at least 2 and 3; 0 if there is none
    std::vector<float> rgb;         // row by row
};

enum class CameraType : uint32_t { perspective, thinlens, orthographic };

// A camera looks along +z of its frame, x points left.
struct Camera {
    CameraType type = CameraType::perspective;
    Vec3f origin{}; // world space
    std::array<Vec3f, 3> axes{
        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; // camera x, y, z in world space
    float tan_half_fov_x = 1; // of the whole film, crop not considered; not orthographic
    // orthographic: half the width of the film, and what would be half its height if it
    // were square, in scene units
    Vec2f half_extent{1, 1};
    float aperture_radius = 0; // thinlens: scene units
    float focus_distance = 1;  // thinlens: along the camera's z
    bool samples_time = false; // whether a number of each sample is spent on its time
    float near_clip = 0.01f, far_clip = 1e4f; // distances along the camera's z
    Vec2f principal_point_offset{};           // in fractions of the film
};

enum class FilterType : uint32_t { box, tent, gaussian, mitchell, catmullrom, lanczos };

struct Film {
    uint32_t width = 1, height = 1; // pixels of the whole film
    uint32_t crop_x = 0, crop_y = 0;
    uint32_t crop_width = 1, crop_height = 1; // the part that is rendered
    FilterType filter = FilterType::box;
    float filter_radius = 0.5f; // pixels; lanczos: also the number of its lobes
    float filter_stddev = 0.5f; // gaussian: pixels
    float filter_b = 1.0f / 3, filter_c = 1.0f / 3; // mitchell
    bool sample_border = false; // also sample a border of the filter's radius
};

struct SceneData {
    std::shared_ptr<const KdTree> tree; // its triangles are the scene's faces, in order
    std::vector<std::array<uint32_t, 3>>
        faces;                  // vertex indices; empty if no shape needs them
    std::vector<Vec3f> normals; // per vertex, unit; empty if no shape needs them
    std::vector<Vec2f> uvs;     // per vertex; empty if no shape needs them
    std::vector<Shape> shapes;  // ordered by first_face, covering all faces, those of
                                // `objects` too
    std::shared_ptr<const ObjectSet> objects; // what is not in the tree; maybe none
    std::vector<Material> materials;
    std::vector<Specular> speculars;
    std::vector<Texture> textures;
    std::vector<Emitter> emitters;
    EnvironmentPicture environment; // of the emitter that is an envmap
    Camera camera;
    Film film;
    bool hide_emitters = false;
};

} // namespace mlrt
