#include "producer/run/particle_table.h"

#include <array>
#include <bit>
#include <cstring>
#include <exception>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace offstage::producer {
namespace {

static_assert(std::endian::native == std::endian::little, "records are written as they are in memory");

/// Rows that are collected before they are written.
constexpr std::size_t kRowsAtOnce = 2000;

constexpr std::array<std::pair<const char*, const char*>, 16> kColumns = {{{"frame", "<u4"},
                                                                           {"time", "<f8"},
                                                                           {"system", "<u4"},
                                                                           {"id", "<u8"},
                                                                           {"age", "<f8"},
                                                                           {"x", "<f8"},
                                                                           {"y", "<f8"},
                                                                           {"z", "<f8"},
                                                                           {"vx", "<f8"},
                                                                           {"vy", "<f8"},
                                                                           {"vz", "<f8"},
                                                                           {"radius", "<f4"},
                                                                           {"red", "<f4"},
                                                                           {"green", "<f4"},
                                                                           {"blue", "<f4"},
                                                                           {"alpha", "<f4"}}};

std::string csv_header() {
  std::string header;
  for (std::size_t i = 0; i < kColumns.size(); ++i)
    header += (i > 0 ? "," : "") + std::string(kColumns[i].first);
  return header;
}

std::string binary_header(const std::vector<std::string>& systems) {
  nlohmann::ordered_json json = {{"format", "offstage particles"}, {"version", 1}, {"systems", systems}};
  auto& columns = json["columns"] = nlohmann::ordered_json::array();
  for (const auto& [name, type] : kColumns) columns.push_back({name, type});
  return json.dump() + "\n";
}

template <class T>
void append(std::vector<uint8_t>& bytes, T value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

}  // namespace

ParticleTable::ParticleTable(const std::filesystem::path& path, const Simulation& simulation)
    : simulation_(simulation), path_(path) {
  if (path.extension() != ".bin") {
    csv_.emplace(path, csv_header());
    return;
  }
  render::remove_leftovers(path.parent_path());
  binary_.emplace(path);
  std::vector<std::string> names;
  simulation.for_each_particle_system(
      [&](const std::string& name, const sim::ParticleArrays&, const PointSet&) { names.push_back(name); });
  const std::string header = binary_header(names);
  bytes_.assign(header.begin(), header.end());
}

ParticleTable::~ParticleTable() {
  if (!binary_) return;
  try {  // keeps the rows collected so far
    flush();
    binary_->commit_as(path_.string() + ".partial");
  } catch (const std::exception&) {
  }
}

void ParticleTable::put_row(int frame, double time, std::size_t system, const std::string& name,
                            const sim::ParticleArrays& particles, const PointSet& drawn, std::size_t i) {
  const sim::Vec3 &p = particles.position[i], &v = particles.velocity[i];
  const render::Point& look = drawn.points[i];
  if (csv_) {
    rows_.count(static_cast<uint64_t>(frame)).number(time).text(name).count(particles.id[i]);
    rows_.number(particles.age[i]).vector(p).vector(v).number(look.radius);
    for (const float channel : look.color) rows_.number(channel);
    rows_.end_row();
    return;
  }
  if (!p.allFinite() || !v.allFinite())
    throw CsvFile::NotFinite(path_.string() + ": a number to be written is not finite");
  append(bytes_, static_cast<uint32_t>(frame));
  append(bytes_, time);
  append(bytes_, static_cast<uint32_t>(system));
  append(bytes_, particles.id[i]);
  append(bytes_, particles.age[i]);
  for (const double x : p) append(bytes_, x);
  for (const double x : v) append(bytes_, x);
  append(bytes_, look.radius);
  for (const float channel : look.color) append(bytes_, channel);
}

void ParticleTable::record(int frame, double time) {
  std::size_t system = 0;
  simulation_.for_each_particle_system(
      [&](const std::string& name, const sim::ParticleArrays& particles, const PointSet& drawn) {
        for (std::size_t i = 0; i < particles.size(); ++i) {
          put_row(frame, time, system, name, particles, drawn, i);
          if (++row_count_ == kRowsAtOnce) flush();
        }
        ++system;
      });
}

void ParticleTable::flush() {
  row_count_ = 0;
  if (csv_) return csv_->write(std::exchange(rows_, {}));
  binary_->write(bytes_);
  bytes_.clear();
}

void ParticleTable::close() {
  flush();
  if (csv_) return csv_->close();
  binary_->commit();
  binary_.reset();
}

}  // namespace offstage::producer
