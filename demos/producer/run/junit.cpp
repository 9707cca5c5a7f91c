#include "producer/run/junit.h"

#include <algorithm>

#include <fmt/format.h>

#include "producer/base/markup.h"

namespace offstage::producer {
namespace {

std::string test_case(const TestResult& result) {
  std::string xml = fmt::format("    <testcase classname=\"{}\" name=\"{}\" file=\"{}\" time=\"{:.3f}\">\n",
                                escape_markup(result.class_name), escape_markup(result.name),
                                escape_markup(result.name), result.seconds);
  if (result.outcome != TestResult::Outcome::passed) {
    const char* element = result.outcome == TestResult::Outcome::failed ? "failure" : "error";
    xml += fmt::format("      <{0} type=\"{1}\" message=\"{2}\">{3}</{0}>\n", element,
                       escape_markup(result.kind), escape_markup(result.message),
                       escape_markup(result.output.empty() ? result.message : result.output));
  } else if (!result.output.empty()) {
    xml += "      <system-out>" + escape_markup(result.output) + "</system-out>\n";
  }
  return xml + "    </testcase>\n";
}

}  // namespace

std::string junit_xml(const std::string& suite, std::span<const TestResult> results) {
  const auto count = [&](TestResult::Outcome outcome) {
    return std::ranges::count(results, outcome, &TestResult::outcome);
  };
  double seconds = 0;
  for (const TestResult& result : results) seconds += result.seconds;
  const std::string figures = fmt::format(
      "name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\"", escape_markup(suite),
      results.size(), count(TestResult::Outcome::failed), count(TestResult::Outcome::error), seconds);
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  xml += "<testsuites " + figures + ">\n  <testsuite " + figures + " skipped=\"0\">\n";
  for (const TestResult& result : results) xml += test_case(result);
  return xml + "  </testsuite>\n</testsuites>\n";
}

}  // namespace offstage::producer
