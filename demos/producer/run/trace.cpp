#include "producer/run/trace.h"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

#include "render/error.h"

namespace offstage::producer {

CsvFile::CsvFile(const std::filesystem::path& path, const std::string& header)
    : path_(path), temporary_(path.string() + fmt::format(".{}.part", getpid())) {
  file_ = std::fopen(temporary_.c_str(), "wb");
  if (!file_) fail();
  write(header + "\n");
}

CsvFile::~CsvFile() {
  if (!file_) return;
  const bool whole_rows = std::fclose(file_) == 0;
  std::error_code ignored;
  if (whole_rows)
    std::filesystem::rename(temporary_, path_.string() + ".partial", ignored);
  else
    std::filesystem::remove(temporary_, ignored);
}

void CsvFile::write(const std::string& rows) {
  if (std::fwrite(rows.data(), 1, rows.size(), file_) != rows.size()) fail();
}

void CsvFile::close() {
  const bool flushed = std::fflush(file_) == 0 && fsync(fileno(file_)) == 0;
  if (!flushed) fail();
  std::fclose(file_);
  file_ = nullptr;
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw render::FileError(path_.string() + ": " + error.message());
}

void CsvFile::fail() {
  throw render::FileError(path_.string() + ": " + std::strerror(errno));
}

Trace::Trace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path, "time,object,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"), simulation_(simulation) {}

void Trace::record(double time) {
  const sim::World& world = simulation_.world();
  std::string rows;
  for (const auto& [name, handle] : simulation_.moving_bodies()) {
    const sim::BodyState s = world.body(handle);
    const sim::Vec3 &p = s.pose.position, &v = s.velocity, &w = s.angular_velocity;
    const sim::Quat& q = s.pose.orientation;
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", time, name,
                   p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(), v.y(), v.z(), w.x(), w.y(), w.z());
  }
  for (const auto& [name, handle] : simulation_.cloths()) {
    const sim::ClothView cloth = world.cloth(handle);
    const std::vector<sim::Real>& masses = world.cloth_def(handle).masses;
    sim::Vec3 p = sim::Vec3::Zero(), v = sim::Vec3::Zero();
    sim::Real mass = 0;
    for (std::size_t i = 0; i < masses.size(); ++i) {
      mass += masses[i];
      p += masses[i] * cloth.points[i];
      v += masses[i] * cloth.velocities[i];
    }
    p /= mass;
    v /= mass;
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},1,0,0,0,{},{},{},0,0,0\n", time, name, p.x(),
                   p.y(), p.z(), v.x(), v.y(), v.z());
  }
  for (const auto& [name, handle] : simulation_.particle_groups()) {
    const sim::ParticleArrays& particles = world.particles(handle);
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const sim::Vec3 &p = particles.position[i], &v = particles.velocity[i];
      fmt::format_to(std::back_inserter(rows), "{},{}/{},{},{},{},1,0,0,0,{},{},{},0,0,0\n", time, name,
                     particles.id[i], p.x(), p.y(), p.z(), v.x(), v.y(), v.z());
    }
  }
  file_.write(rows);
}

ClothTrace::ClothTrace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path,
            "time,cloth,points,max_strain,mean_strain,contacts,self_contacts,penetration,limited,held_back,"
            "crossings,torn,unconverged"),
      simulation_(simulation) {}

void ClothTrace::record(double time) {
  const sim::World& world = simulation_.world();
  std::string rows;
  for (const auto& [name, handle] : simulation_.cloths()) {
    const sim::ClothReport& r = world.cloth_report(handle);
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{},{},{},{},{},{},{},{}\n", time, name,
                   world.cloth(handle).points.size(), r.max_strain, r.mean_strain, r.contacts,
                   r.self_contacts, r.penetration, r.limited, r.held_back, r.crossings, r.torn,
                   r.unconverged);
  }
  file_.write(rows);
}

JointTrace::JointTrace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path, "time,joint,x,y,z,fx,fy,fz,tx,ty,tz,coordinate,speed,error,broken"),
      simulation_(simulation) {}

void JointTrace::record(double time) {
  const sim::World& world = simulation_.world();
  std::string rows;
  world.for_each_joint([&](sim::JointHandle handle) {
    const sim::JointState j = world.joint(handle);
    const sim::Vec3 &p = j.anchor_a, &f = j.force, &t = j.torque;
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", time,
                   world.joint_def(handle).name, p.x(), p.y(), p.z(), f.x(), f.y(), f.z(), t.x(), t.y(),
                   t.z(), j.coordinate, j.speed, j.error, j.broken ? 1 : 0);
  });
  file_.write(rows);
}

ContactTrace::ContactTrace(const std::filesystem::path& path, const Simulation& simulation)
    : file_(path, "time,a,b,x,y,z,nx,ny,nz,fx,fy,fz,separation"), simulation_(simulation) {}

void ContactTrace::record(double time) {
  const sim::World& world = simulation_.world();
  std::string rows;
  for (const sim::ContactState& c : world.contacts()) {
    const sim::Vec3 &p = c.point, &n = c.normal, &f = c.force;
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{},{},{},{},{},{},{},{}\n", time,
                   world.body_def(c.a).name, world.body_def(c.b).name, p.x(), p.y(), p.z(), n.x(), n.y(),
                   n.z(), f.x(), f.y(), f.z(), c.separation);
  }
  file_.write(rows);
}

}  // namespace offstage::producer
