#pragma once
/// Results of tests in the XML format that CI systems read (JUnit).

#include <span>
#include <string>

namespace offstage::producer {

struct TestResult {
  enum class Outcome { passed, failed, error };  ///< error: the test could not be run

  std::string name;        ///< name of the test: a scene file
  std::string class_name;  ///< group of the test: a folder of goldens
  double seconds = 0;      ///< [s]
  Outcome outcome = Outcome::passed;
  std::string kind;     ///< kind of the failure or error
  std::string message;  ///< message of the failure or error, one line; empty if passed
  std::string output;   ///< output of the test, for every outcome
};

/// Returns the XML text: one <testsuites> element with one <testsuite>, the form that Jenkins, GitLab and
/// pytest use. `suite`: name of the test suite.
std::string junit_xml(const std::string& suite, std::span<const TestResult> results);

}  // namespace offstage::producer
