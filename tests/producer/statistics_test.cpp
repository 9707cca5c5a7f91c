/// The statistics of a run are documented.

#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "producer/run/production.h"

namespace offstage::producer {
namespace {

TEST(Statistics, HaveAllTheirKeysInTheDocuments) {
  std::ifstream in(OFFSTAGE_SOURCE_DIR "/docs/output-files.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  RunStats stats;
  stats.energy_start = stats.energy_end = sim::Energy();
  stats.interrupted_by = 2;
  const auto expect = [&](const std::string& key) {
    EXPECT_NE(page.find("`" + key + "`"), std::string::npos) << key;
  };
  const auto figures = nlohmann::json::parse(to_json(stats));
  for (const auto& [key, value] : figures.items())
    if (key != "cloth") expect(key);
  for (const auto& [key, value] : figures["cloth"].items()) expect("cloth." + key);
}

}  // namespace
}  // namespace offstage::producer
