// Mirrors and glass: where they send a ray, and how much of the light from there they pass
// on.
#pragma once

#include "render/scene.h"

namespace mlrt {

// In the frame of the surface, whose z is the shading normal.
struct SpecularSample {
    Vec3f direction;
    Vec3f weight; // of the light that arrives from there; zero if none may
};

// `back` leads to where the ray came from, a unit vector that is not in the surface. A
// `part` in [0, 1) chooses between what is reflected and what is refracted, as in Mitsuba
// (3.9's conductor.cpp, dielectric.cpp, thindielectric.cpp).
SpecularSample sample_specular(const Specular &specular, Vec3f back, float part);

// The share of unpolarised light that a plane between two media reflects.
struct DielectricReflectance {
    float share;
    float cosine; // of the refracted direction, on the other side; 0: total reflection
    float ratio;  // index on the side that light comes from, over that of the other side
};

// By Fresnel's equations. cosine: of the angle of incidence, negative from inside. ior:
// index of the inside over that of the outside.
DielectricReflectance reflectance_of_dielectric(float cosine, float ior);

// The same of a metal with the complex index eta + i k, at a cosine in [0, 1] (Moeller,
// Optics, 2nd edition, 2007).
float reflectance_of_conductor(float cosine, float eta, float k);

} // namespace mlrt
