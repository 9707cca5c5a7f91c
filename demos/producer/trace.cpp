#include "producer/trace.h"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

#include "render/error.h"

namespace offstage::producer {

Trace::Trace(const std::filesystem::path& path, const Simulation& simulation)
    : path_(path), temporary_(path.string() + fmt::format(".{}.part", getpid())), simulation_(simulation) {
  file_ = std::fopen(temporary_.c_str(), "wb");
  if (!file_) throw render::FileError(path_.string() + ": " + std::strerror(errno));
  write("time,object,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n");
}

Trace::~Trace() {
  if (!file_) return;
  const bool whole_rows = std::fclose(file_) == 0;
  std::error_code ignored;
  if (whole_rows)
    std::filesystem::rename(temporary_, path_.string() + ".partial", ignored);
  else
    std::filesystem::remove(temporary_, ignored);
}

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
  for (const auto& [name, handle] : simulation_.particle_groups()) {
    const sim::ParticleArrays& particles = world.particles(handle);
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const sim::Vec3 &p = particles.position[i], &v = particles.velocity[i];
      fmt::format_to(std::back_inserter(rows), "{},{}/{},{},{},{},1,0,0,0,{},{},{},0,0,0\n", time, name,
                     particles.id[i], p.x(), p.y(), p.z(), v.x(), v.y(), v.z());
    }
  }
  write(rows);
}

void Trace::write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail();
}

void Trace::close() {
  const bool flushed = std::fflush(file_) == 0 && fsync(fileno(file_)) == 0;
  if (!flushed) fail();
  std::fclose(file_);
  file_ = nullptr;
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw render::FileError(path_.string() + ": " + error.message());
}

void Trace::fail() {
  throw render::FileError(path_.string() + ": " + std::strerror(errno));
}

}  // namespace offstage::producer
