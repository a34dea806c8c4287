"""The JSON Schema of scenarios: its tables, types, and units in words, and values that scenarios give to its keys."""

import json


def toml(value):
    """A value as TOML in one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(toml(one) for one in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, float) and value == int(value) and abs(value) < 1e6:
        return str(int(value))
    return str(value)


class Schema:
    """The JSON Schema of scenarios."""

    def __init__(self, root):
        self.root = root

    def resolve(self, schema):
        """Behind references, and behind a choice with null."""
        while True:
            if "$ref" in schema:
                schema = self.root["$defs"][schema["$ref"].rsplit("/", 1)[1]]
            elif "anyOf" in schema:
                schema = next(one for one in schema["anyOf"] if one.get("type") != "null")
            else:
                return schema

    def words(self, schema):
        """Allowed words with their meaning, if the schema is a choice of words."""
        if all(isinstance(one, str) for one in schema.get("enum", [0])):
            return [(word, "") for word in schema["enum"]]
        found = []
        for one in schema.get("oneOf", []):
            if "const" in one:
                found.append((one["const"], one.get("description", "")))
            elif "enum" in one:
                found += [(word, "") for word in one["enum"]]
            else:
                return []
        return found

    def kinds(self, schema):
        """Variants of a table by their `kind`."""
        return {
            one["properties"]["kind"]["const"]: one
            for one in schema.get("oneOf", [])
            if "const" in one.get("properties", {}).get("kind", {})
        }

    def is_table(self, schema):
        return "properties" in schema or bool(self.kinds(schema))

    def items(self, schema):
        return self.resolve(schema["items"]) if isinstance(schema.get("items"), dict) else {}

    def variant(self, schema, value):
        kinds = self.kinds(schema)
        return kinds.get(value.get("kind"), {}) if kinds else schema


def examples(schema, documents):
    """Values of keys by (title of the table's schema, key): the first that a document has."""
    found = {}

    def walk(table_schema, name, table):
        table_schema = schema.resolve(table_schema)
        variant = schema.variant(table_schema, table)
        kind = table.get("kind") if schema.kinds(table_schema) else None
        for key, value in table.items():
            inner = variant.get("properties", {}).get(key)
            if inner is None:
                continue
            found.setdefault((name, kind, key), value)
            inner_name = definition(inner) or f"{name}.{key}"
            inner = schema.resolve(inner)
            if isinstance(value, dict):
                walk(inner, inner_name, value)
            elif isinstance(value, list):
                for one in value:
                    if isinstance(one, dict):
                        walk(inner["items"], definition(inner["items"]) or inner_name, one)

    for document in documents:
        walk(schema.root, "Scenario", document)
    return found


def definition(schema):
    """Name of the definition a schema refers to."""
    for one in [schema, *schema.get("anyOf", [])]:
        if "$ref" in one:
            return one["$ref"].rsplit("/", 1)[1]
    return None


def bounds(schema):
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    return ", ".join(f"{sign} {schema[key]:,}" for key, sign in signs.items() if key in schema)


def type_of(schema, root):
    """What a value is, in words, and its units."""
    inner = root.resolve(schema)
    both = {**inner, **{key: value for key, value in schema.items() if key != "description"}}
    if "x-dimension" in both:
        units = [unit for unit in both["x-units"] if unit != "1"]
        text = both["x-dimension"]
        if text == "pure number":
            text, units = "number", []
        if units:
            text += f" in {units[0]}" + (f" (also {', '.join(units[1:])})" if units[1:] else "")
        text += "".join(f' or `"{word}"`' for word in both.get("x-words", []))
    elif root.words(inner):
        text = "word"
    elif root.is_table(inner):
        text = "table"
    elif inner.get("type") == "array" or "array" in inner.get("type", []):
        if "prefixItems" in inner:
            return f"[{', '.join(type_of(item, root) for item in inner['prefixItems'])}]"
        items, low, high = inner["items"], inner.get("minItems"), inner.get("maxItems")
        count = f"{low} × " if low == high and low else ""
        text = f"list: {count}{type_of(items, root)}"
    else:
        kind = inner.get("type", "value")
        kind = next(one for one in kind if one != "null") if isinstance(kind, list) else kind
        text = {"boolean": "true or false", "integer": "integer", "string": "string", "number": "number"}.get(kind, kind)
        if "enum" in both:
            text += ": " + ", ".join(map(str, both["enum"]))
    limit = bounds(both)
    return text + (f", {limit}" if limit else "")
