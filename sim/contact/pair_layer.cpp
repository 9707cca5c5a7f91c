/// The part of ContactPair that treats cloth between its bodies as a layer in their contacts.

#include <algorithm>
#include <cmath>

#include "sim/contact/contact_pair.h"

namespace offstage::sim {
namespace {

/// A layer of cloth that is compressed gets thicker by at most this fraction of its thickness at a time.
constexpr Real kLayerRecovery = 0.05;
/// A layer may be this far beyond the surfaces, in thicknesses: bodies that overlap the cloth.
constexpr Real kLayerReach = 1.2;
/// Cloth slides on a body if its velocity relative to it is greater than this [m/s].
constexpr Real kLayerSlides = 0.01;

}  // namespace

void ContactPair::set_cloth(std::span<const LayerTriangle> cloth) {
  if (cloth.empty()) {
    if (!layer_) return;
    surface_ = layer_->bare;
    layer_.reset();
    found_margin_ = 0;  // the points contain the layer, so they are not reused
    return;
  }
  if (!layer_) layer_ = std::make_unique<PairLayer>(PairLayer{.bare = surface_});
  layer_->cloth = cloth;
  layer_->thickest = std::ranges::max(cloth, {}, &LayerTriangle::thickness).thickness;
}

/// Notes that no contact point is at cloth.
void ContactPair::clear_layers() {
  layer_->places.clear();
  surface_ = layer_->bare;
}

/// Moves the contact points of both bodies towards each other by the distance that cloth between them keeps.
/// Cloth that is compressed to less than this distance gets thicker slowly, as the overlap of bodies is
/// removed slowly. The cloth also determines the surface of the pair: it absorbs impacts, and its friction
/// on both bodies acts between them unless the cloth slides on both.
void ContactPair::insert_layers() {
  PairLayer& layer = *layer_;
  layer.places.clear();
  Real friction = kInfinity, on_a = 0, on_b = 0;  // greatest velocities of the cloth on the bodies
  for (PlacedManifold& placed : placed_) {
    Manifold& m = placed.manifold;
    const Vec3& n = m.normal;
    for (uint32_t k = 0; k < m.count; ++k) {
      ContactPoint& p = m.points[k];
      const Vec3 middle = (p.on_a + p.on_b) / 2;
      const Real reach = std::abs(p.separation) / 2 + kLayerReach * layer.thickest;
      const ClothLayers found = layers_across(layer.cloth, middle, n, reach);
      if (!found.lowest) continue;
      const Real keeps =
          std::min(found.distance, std::max(p.separation, 0.0) + kLayerRecovery * found.distance);
      p.on_a -= keeps / 2 * n;
      p.on_b += keeps / 2 * n;
      p.separation -= keeps;
      const auto slip = [&](const Body& body) {
        const Vec3 relative = found.lowest->velocity - body.start_velocity(middle) -
                              body.start_pose.vector_to_world(body.def.surface_velocity);
        return (relative - n.dot(relative) * n).norm();
      };
      on_a = std::max(on_a, slip(*a_));
      on_b = std::max(on_b, slip(*b_));
      friction = std::min(friction,
                          std::sqrt(found.lowest->friction * std::min(a_->def.friction, b_->def.friction)));
      layer.places.push_back({middle, n, found.lowest->cloth, found.lowest->number});
    }
  }
  surface_ = layer.bare;
  if (layer.places.empty()) return;
  layer.slides = std::min(on_a, on_b) > kLayerSlides;
  const auto inverse_mass = [](const Body& body) { return body.is_dynamic() ? 1 / body.rigid.mass : 0; };
  layer.holds_by_a =
      std::max(on_a, on_b) > kLayerSlides ? on_a < on_b : inverse_mass(*a_) < inverse_mass(*b_);
  surface_.restitution = 0;
  surface_.friction = surface_.static_friction = layer.slides ? 0 : friction;
  surface_.cross = 1;
  surface_.axis_body = nullptr;
  if (layer.slides) surface_.rolling = surface_.spinning = 0;
}

}  // namespace offstage::sim
