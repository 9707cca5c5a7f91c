#pragma once
/// What is wrong with a scene, and where. Thrown for bad input only; caught in main.

#include <stdexcept>
#include <string>
#include <vector>

namespace offstage {

/// A place in a scene file. `path` is a JSON pointer such as /emitters/0/rate.
struct Where {
  std::string file;
  int line = 0, column = 0;  ///< from 1; 0: not from a file (an override, a default)
  std::string path;
};

/// A report of problems lists so many of them, then counts.
inline constexpr std::size_t kMostProblems = 50;

/// One problem: "file:line:col: /path: what is wrong; what is allowed".
struct Problem {
  Where where;
  std::string what;

  std::string describe() const;
};

/// A scene that cannot be used, with the problems found: at most kMostProblems, and one more that counts the
/// rest.
class SceneError : public std::runtime_error {
 public:
  explicit SceneError(std::vector<Problem> problems);
  SceneError(const Where& where, const std::string& what) : SceneError(std::vector{Problem{where, what}}) {}
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

}  // namespace offstage
