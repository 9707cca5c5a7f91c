/// The schema and the reference of the scene format, both from the table.

#include "producer/format/scene_io.h"
#include "producer/format/scene_table.h"

namespace offstage::producer {
namespace {

constexpr const char* kIntroduction = R"(# Scene format

A scene is a JSON file. It describes objects, their motion, and the film that is made of them:

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

Every key has a default, except where its row says "required". Unknown keys, values of the wrong type or out of
range, and names that do not exist are errors. offstage reports all of them at once, each with file, line,
column and path.

- **Comments** are `// to the end of the line` and `/* between */`.
- **Units** are metres, kilograms, seconds and radians. Keys in degrees have a name that ends in `_deg`.
  Axes are right-handed and Y is up. The simulation is designed for sizes from 0.001 to 100 m and speeds below
  300 m/s.
- **Frames** are numbered from 1; frame k shows the time start + (k - 1) / fps. A film has
  duration * fps frames, rounded.
- **Files** (models, textures) are searched in the folder of the scene file. If the scene is read from standard
  input (`-` instead of a file), they are searched in the current folder.
- **Names** are optional; an object without a name is called after its kind and index, such as `body_3`.
- **Editors** complete and check a scene that starts with `"$schema": "scene.schema.json"`, a file that
  `offstage schema` prints.

## Orientations

`[w, x, y, z]`, a quaternion that need not be normalized, or `{"axis": [x, y, z], "angle_deg": 90}`.

## Colours

`"#rrggbb"` or `"#rrggbbaa"` in sRGB, as picture editors show them (short form `"#rgb"` or `"#rgba"`: `#f80` is
`#ff8800`), or linear `[r, g, b]` or `[r, g, b, a]`, where values above 1 glow. Alpha is not premultiplied: 0 is
transparent, 1 is opaque.

## Numbers that vary

A key of type *varying* accepts one of these values:

| value | meaning |
| --- | --- |
| `3` | a constant |
| `{"mean": 4, "deviation": 2}` | normal distribution, truncated at mean - deviation and mean + deviation |
| `{"mean": 4, "deviation": 2, "clip": false, "min": 0}` | normal distribution, truncated only at `min` and `max` |
| `{"range": [1, 2]}` | uniform distribution |
| `{"curve": [[0, 1], [2, 5]]}` | curve over time: pairs `[time, value]` with increasing times, linear between them, constant before the first and after the last |

All possible values must lie in the key's range.

## Copies

Bodies and emitters may have `repeat`, `grid` and `scatter`. The three can be combined; their counts multiply.
A copy is the original moved as a whole, with its velocities and keyframes. Copies of `rock` are called
`rock_0`, `rock_1` and so on, and other objects refer to them by these names. In the lists of objects that a
force acts on, `rock` selects all copies. One object has at most 100000 copies.

## Including files

The top-level key `"include": ["stage.json"]` reads other scene files first; their paths are relative to the
including file. Top-level lists (`materials`, `bodies` ...) are concatenated, included entries first. Other
objects are merged key by key, and keys of the including file override included ones. An object with a `type`
replaces an object of another type.

## Overrides

`--set path=value` on the command line changes or adds a key: `--set emitters.0.rate=50`, `--set
/emitters/0/rate=50`, or by name `--set emitters.rain.rate=50`. The value is JSON;
anything else is taken as a string. The result is checked like the file.
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
