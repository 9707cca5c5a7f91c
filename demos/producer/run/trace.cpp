#include "producer/run/trace.h"

#include <fmt/format.h>

namespace offstage::producer {
namespace {

void add_state(CsvRows& rows, double time, std::string_view name, const sim::Vec3& position,
               const sim::Quat& q, const sim::Vec3& velocity, const sim::Vec3& angular_velocity) {
  rows.number(time).text(name).vector(position).number(q.w()).number(q.x()).number(q.y()).number(q.z());
  rows.vector(velocity).vector(angular_velocity).end_row();
}

}  // namespace

Trace::Trace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path, "time,object,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"), simulation_(simulation) {}

void Trace::record(double time) {
  const sim::World& world = simulation_.world();
  CsvRows rows;
  for (const auto& [name, handle] : simulation_.moving_bodies()) {
    if (!world.is_present(handle)) continue;
    const sim::BodyState s = world.body(handle);
    add_state(rows, time, name, s.pose.position, s.pose.orientation, s.velocity, s.angular_velocity);
  }
  const sim::Quat upright = sim::Quat::Identity();
  const sim::Vec3 none = sim::Vec3::Zero();
  for (const auto& [name, handle] : simulation_.cloths()) {
    if (!world.is_present(handle)) continue;
    const sim::ClothView cloth = world.cloth(handle);
    sim::Vec3 p = none, v = none;
    sim::Real mass = 0;
    for (std::size_t i = 0; i < cloth.masses.size(); ++i) {
      mass += cloth.masses[i];
      p += cloth.masses[i] * cloth.points[i];
      v += cloth.masses[i] * cloth.velocities[i];
    }
    add_state(rows, time, name, p / mass, upright, v / mass, none);
  }
  for (const Simulation::Group& group : simulation_.particle_groups()) {
    const sim::ParticleArrays& particles = world.particles(group.handle);
    for (std::size_t i = 0; i < particles.size(); ++i)
      add_state(rows, time, fmt::format("{}/{}", group.scene->name, particles.id[i]), particles.position[i],
                upright, particles.velocity[i], none);
  }
  file_.write(rows);
}

ClothTrace::ClothTrace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path,
            "time,cloth,points,max_strain,mean_strain,contacts,self_contacts,penetration,limited,held_back,"
            "crossings,torn,unconverged,bend_limited,max_bend,volume,pressure"),
      simulation_(simulation) {}

void ClothTrace::record(double time) {
  const sim::World& world = simulation_.world();
  CsvRows rows;
  for (const auto& [name, handle] : simulation_.cloths()) {
    if (!world.is_present(handle)) continue;
    const sim::ClothReport& r = world.cloth_report(handle);
    rows.number(time).text(name).count(world.cloth(handle).points.size());
    rows.number(r.max_strain)
        .number(r.mean_strain)
        .count(r.contacts)
        .count(r.self_contacts)
        .number(r.penetration);
    rows.count(r.limited).count(r.held_back).count(r.crossings).count(r.torn).count(r.unconverged);
    const sim::ClothGasState gas = world.cloth_gas(handle);
    rows.count(r.bend_limited).number(r.max_bend).number(gas.volume).number(gas.pressure).end_row();
  }
  file_.write(rows);
}

ClothPointTrace::ClothPointTrace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path, "time,cloth,vertex,x,y,z,vx,vy,vz"), simulation_(simulation) {}

void ClothPointTrace::record(double time) {
  for (const auto& [name, handle] : simulation_.cloths()) {
    if (!simulation_.world().is_present(handle)) continue;
    const sim::ClothView cloth = simulation_.world().cloth(handle);
    CsvRows rows;
    for (std::size_t i = 0; i < cloth.points.size(); ++i)
      rows.number(time).text(name).count(i).vector(cloth.points[i]).vector(cloth.velocities[i]).end_row();
    file_.write(rows);
  }
}

JointTrace::JointTrace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path, "time,joint,x,y,z,fx,fy,fz,tx,ty,tz,coordinate,speed,error,broken"),
      simulation_(simulation) {}

void JointTrace::record(double time) {
  const sim::World& world = simulation_.world();
  CsvRows rows;
  world.for_each_joint([&](sim::JointHandle handle) {
    const sim::JointState j = world.joint(handle);
    rows.number(time).text(world.joint_def(handle).name).vector(j.anchor_a).vector(j.force).vector(j.torque);
    rows.number(j.coordinate).number(j.speed).number(j.error).count(j.broken ? 1 : 0).end_row();
  });
  file_.write(rows);
}

ContactTrace::ContactTrace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path, "time,a,b,x,y,z,nx,ny,nz,fx,fy,fz,separation"), simulation_(simulation) {}

void ContactTrace::record(double time) {
  const sim::World& world = simulation_.world();
  CsvRows rows;
  for (const sim::ContactState& c : world.contacts()) {
    rows.number(time).text(world.body_def(c.a).name).text(world.body_def(c.b).name);
    rows.vector(c.point).vector(c.normal).vector(c.force).number(c.separation).end_row();
  }
  file_.write(rows);
}

}  // namespace offstage::producer
