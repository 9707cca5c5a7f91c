/// Computes the hash of the whole changing state, in slot order and little-endian bytes (the only supported
/// byte order).

#include <algorithm>
#include <bit>
#include <new>
#include <type_traits>

#include <xxhash.h>

#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

static_assert(std::endian::native == std::endian::little);

class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) {
    if (!state_) throw std::bad_alloc();
    XXH3_128bits_reset(state_);
  }
  ~Hasher() { XXH3_freeState(state_); }
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  template <class T>
  requires std::is_arithmetic_v<T>
  void add(T value) { bytes(&value, sizeof value); }
  void add(const Vec3& v) { bytes(v.data(), sizeof(Real) * 3); }
  void add(const Quat& q) { bytes(q.coeffs().data(), sizeof(Real) * 4); }
  template <class Tag>
  void add(Handle<Tag> h) {
    add(h.index);
    add(h.generation);
  }
  template <class T>
  void add(const std::vector<T>& v) {
    add(uint64_t{v.size()});
    bytes(v.data(), v.size() * sizeof(T));
  }

  StateHash digest() const {
    const XXH128_hash_t h = XXH3_128bits_digest(state_);
    return {h.low64, h.high64};
  }

 private:
  void bytes(const void* data, std::size_t size) { XXH3_128bits_update(state_, data, size); }

  XXH3_state_t* state_;
};

}  // namespace

StateHash World::state_hash() const {
  Hasher hash;
  hash.add(impl_->now);
  impl_->bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
    hash.add(handle);
    hash.add(body->pose.position);
    hash.add(body->pose.orientation);
    hash.add(body->type != body->def.motion);
    if (body->def.motion != MotionType::dynamic) return;
    hash.add(body->rigid.momentum);
    hash.add(body->rigid.angular_momentum);
  });
  impl_->systems.for_each([&](ParticleSystemHandle handle, const ParticleSystem& system) {
    const ParticleArrays& a = system.arrays;
    hash.add(handle);
    hash.add(system.next_id);
    for (const auto* v : {&a.position, &a.velocity}) hash.add(*v);
    for (const auto* v : {&a.mass, &a.radius, &a.age, &a.lifespan, &a.restitution, &a.friction}) hash.add(*v);
    hash.add(a.id);
    if (system.def.rotates) hash.add(a.angular_velocity);
    for (const Quat& q : a.orientation) hash.add(q);
    // Charges are hashed only if there are any, so that the hash of scenes without charges does not change.
    if (std::any_of(a.charge.begin(), a.charge.end(), [](Real q) { return q != 0; })) hash.add(a.charge);
  });
  impl_->springs.for_each([&](SpringHandle handle, const Spring& spring) {
    hash.add(handle);
    hash.add(spring.rest_length);
  });
  impl_->cloths.for_each([&](ClothHandle handle, const std::unique_ptr<Cloth>& cloth) {
    hash.add(handle);
    hash.add(cloth->version);
    for (const auto* v : {&cloth->points, &cloth->velocities}) hash.add(*v);
    hash.add(cloth->sources);
  });
  return hash.digest();
}

std::string StateHash::hex() const {
  std::string text;
  for (uint64_t word : {high, low})
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[(word >> shift) & 15];
  return text;
}

}  // namespace offstage::sim
