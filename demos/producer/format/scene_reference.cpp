/// The schema and the reference of the scene format, both from the table.

#include "producer/format/scene_io.h"
#include "producer/format/scene_table.h"

namespace offstage::producer {
namespace {

constexpr const char* kIntroduction = R"(# Scene format

A scene is a JSON file. It says what there is, how it moves, and how it is filmed:

```json
{
  "version": 1,
  // a ball falls past a spinning wheel
  "materials": [{"name": "red", "color": "#c03020", "roughness": 0.3}],
  "bodies": [
    {"name": "ball", "shape": {"type": "sphere", "radius": 0.2}, "material": "red", "position": [0, 3, 0]},
    {"name": "wheel", "shape": {"type": "cylinder", "radius": 1, "height": 0.1}, "position": [2, 1, 0],
     "motion": "kinematic", "spin": [0, 3, 0]}
  ],
  "camera": {"type": "orbit", "radius": 6},
  "output": {"duration": 2}
}
```

Every key has a default, except where its row says "required". A key that is not known, a value of the wrong
type or out of its range, and a name that leads nowhere are errors; all of them are reported at once, each
with file, line, column and path.

- **Comments** are `// to the end of the line` and `/* between */`.
- **Units** are metres, kilograms, seconds and radians. What is in degrees says so in its name (`fov_deg`).
  Axes are right-handed and Y is up. Sizes from 0.001 to 100 m and speeds below 300 m/s are what the
  simulation is made for.
- **Frames** are numbered from 1; frame k shows the time start + (k - 1) / fps. There are duration * fps of
  them, rounded.
- **Files** (models, textures) are sought in the folder of the scene file; those of a scene from standard input
  (`-` in place of the file) in the current folder.
- **Names** may be left out; an object without one is called after its kind and index, like `body_3`.
- **Editors** complete and check a scene that starts with `"$schema": "scene.schema.json"`, the output of
  `offstage schema`.

## Orientations

`[w, x, y, z]`, a quaternion that need not be normalised, or `{"axis": [x, y, z], "angle_deg": 90}`.

## Colours

`"#rrggbb"` or `"#rrggbbaa"` in sRGB, as picture editors show them (in short `"#rgb"` or `"#rgba"`: `#f80` is
`#ff8800`), or linear `[r, g, b]` or `[r, g, b, a]`, where values above 1 glow. Alpha is straight: 0 is transparent, 1 opaque.

## Numbers that vary

A key of type *varying* takes one of

| value | meaning |
| --- | --- |
| `3` | always the same |
| `{"mean": 4, "deviation": 2}` | normal distribution, cut off at mean - deviation and mean + deviation |
| `{"mean": 4, "deviation": 2, "clip": false, "min": 0}` | normal distribution that is not cut off there, but at `min` and `max` |
| `{"range": [1, 2]}` | uniform distribution |
| `{"curve": [[0, 1], [2, 5]]}` | over time: `[time, value]` with increasing times, linear between them, held at the ends |

All that it can become must lie in the key's range.

## Copies

Bodies and emitters may have `repeat`, `grid` and `scatter`. They multiply: a repeat of a grid of a scatter.
A copy is the original moved as a whole, with its velocities and keyframes; copies of `rock` are called
`rock_0`, `rock_1` and so on, and other objects refer to them by these names; in the list of what a force
acts on, `rock` is all of them. One object has at most 100000 copies.

## Including files

`"include": ["stage.json"]` at the top reads other scene files first, sought beside the file that names
them. Lists at the top (`materials`, `bodies` ...) are joined, the included ones first; other objects are
merged key by key, and the including file wins. An object that names its `type` replaces one of another
type.

## Overrides

`--set path=value` on the command line changes or adds a key: `--set emitters.0.rate=50`, `--set
/emitters/0/rate=50`, or by name `--set emitters.rain.rate=50`. The value is JSON, or else text. It is
checked like the file.
)";

std::string table_of(const ObjectEntry& object) {
  std::string text =
      "| key | type | unit | range | default | meaning |\n| --- | --- | --- | --- | --- | --- |\n";
  for (const Row& row : object.rows)
    text += "| `" + row.key + "` | " + row.type + " | " + row.unit + " | " + row.range + " | " + row.initial +
            " | " + row.help + " |\n";
  return text;
}

std::string choice_of(const ObjectEntry& object) {
  std::string text;
  for (const std::string& name : object.alternatives) text += "- [" + name + "](#" + name + ")\n";
  return text;
}

}  // namespace

std::string scene_schema() {
  const Catalogue catalogue = scene_catalogue();
  Object schema = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "offstage scene"}};
  Object definitions = catalogue.shared();
  for (const ObjectEntry& object : catalogue.objects()) {
    if (&object != &catalogue.objects().front()) {
      definitions.push_back({object.name, object.definition()});
      continue;
    }
    ObjectEntry root = object;
    const Object text = {{"type", "string"}, {"minLength", 1}};
    root.properties.push_back({"$schema", Object{{"type", "string"}}});
    root.properties.push_back(
        {"include",
         Object{{"type", "array"}, {"items", text}, {"description", "scene files to read first"}}});
    const Node definition = root.definition();
    for (const Member& member : *definition.as<Object>()) schema.push_back(member);
  }
  schema.push_back({"definitions", std::move(definitions)});
  return to_text(schema, 2) + "\n";
}

std::string scene_reference() {
  const Catalogue catalogue = scene_catalogue();
  std::string text = kIntroduction;
  text += "\n# Objects\n";
  for (const ObjectEntry& object : catalogue.objects()) {
    text += "\n## " + object.name + "\n\n" + object.help + "\n";
    if (!object.alternatives.empty()) text += "\nOne of\n\n" + choice_of(object);
    if (!object.rows.empty()) text += "\n" + table_of(object);
  }
  return text;
}

}  // namespace offstage::producer
