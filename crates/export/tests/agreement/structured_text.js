// A small interpreter of IEC 61131-3 structured text: functions and function blocks over BOOL, DINT and LREAL and arrays of
// them. It refuses what it does not know: undeclared names, mixed types, writes to constants and inputs, places outside an
// array, and names that mean something to a controller. All numbers are IEEE doubles, as LREAL is.
"use strict";

const KEYWORDS = ("IF THEN ELSIF ELSE END_IF FOR TO BY DO END_FOR WHILE END_WHILE NOT AND OR MOD TRUE FALSE VAR VAR_INPUT VAR_OUTPUT " +
    "END_VAR CONSTANT TYPE END_TYPE ARRAY OF FUNCTION END_FUNCTION FUNCTION_BLOCK END_FUNCTION_BLOCK BOOL DINT LREAL").split(" ");
const RESERVED = ("LEFT RIGHT MID LEN CONCAT INSERT DELETE REPLACE FIND SEL MUX GT GE EQ LE LT NE ADD SUB MUL DIV MOVE SHL SHR ROL ROR " +
    "LOG SIN COS TAN ASIN ACOS ATAN EXPT TRUNC SR RS TON TOF TP CTU CTD TIME DATE REAL INT STRING STEP ACTION TASK PROGRAM AT RETAIN XOR " +
    "CASE REPEAT UNTIL EXIT RETURN WITH STRUCT N R S L D P").split(" ");
const STANDARD = {
    ABS: [["LREAL"], "LREAL", Math.abs], SQRT: [["LREAL"], "LREAL", Math.sqrt], LN: [["LREAL"], "LREAL", Math.log],
    EXP: [["LREAL"], "LREAL", Math.exp], MIN: [["LREAL", "LREAL"], "LREAL", Math.min], MAX: [["LREAL", "LREAL"], "LREAL", Math.max],
    LIMIT: [["LREAL", "LREAL", "LREAL"], "LREAL", (low, x, high) => Math.min(Math.max(x, low), high)],
    DINT_TO_LREAL: [["DINT"], "LREAL", (x) => x],
};

function tokens(text) {
    const found = [];
    const next = /\(\*[^]*?\*\)|\s+|([A-Za-z_][A-Za-z0-9_]*)|(\d+\.\d+(?:E[+-]?\d+)?)|(\d+)|(:=|<=|>=|<>|\.\.|[-+*\/()\[\],;:=<>.])/y;
    while (next.lastIndex < text.length) {
        const at = next.lastIndex;
        const own = next.exec(text);
        if (own === null) throw new Error("not understood: " + text.slice(at, at + 40));
        const [, word, real, whole, sign] = own;
        if (word !== undefined) {
            const upper = word.toUpperCase();
            found.push(KEYWORDS.includes(upper) ? { kind: upper } : { kind: "name", text: upper });
        } else if (real !== undefined) found.push({ kind: "LREAL", text: real });
        else if (whole !== undefined) found.push({ kind: "DINT", text: whole });
        else if (sign !== undefined) found.push({ kind: sign });
    }
    found.push({ kind: "end" });
    return found;
}

/// The function blocks of a text, as constructors by their names.
function structuredText(text) {
    const list = tokens(text);
    let at = 0;
    const functions = {};
    const blocks = {};
    const types = {};
    let scope = null;
    const peek = () => list[at].kind;
    const fail = (what) => { throw new Error(`${what}, near ${list.slice(Math.max(0, at - 8), at + 4).map((t) => t.text ?? t.kind).join(" ")}`); };
    const take = (kind) => (list[at].kind === kind ? list[at++] : fail(`expected ${kind}`));
    const taken = (kind) => list[at].kind === kind && Boolean(list[at++]);
    const same = (a, b) => (a === b ? a : fail(`${a} and ${b} are mixed`));

    function typeName() {
        for (const kind of ["BOOL", "DINT", "LREAL"]) if (taken(kind)) return { element: kind };
        const name = take("name").text;
        if (types[name]) return types[name];
        return blocks[name] ? { block: name } : fail(`unknown type ${name}`);
    }
    function arrayOrType() {
        if (!taken("ARRAY")) { const type = typeName(); return { length: type.length ?? null, type: { element: type.element, block: type.block } }; }
        take("[");
        if (Number(take("DINT").text) !== 0) fail("arrays begin at 0");
        take("..");
        const length = Number(take("DINT").text) + 1;
        take("]");
        take("OF");
        return { length, type: typeName() };
    }
    function signed() {
        const minus = taken("-");
        const own = list[at++];
        if (own.kind === "TRUE" || own.kind === "FALSE") return { type: "BOOL", value: own.kind === "TRUE" };
        if (own.kind !== "LREAL" && own.kind !== "DINT") fail("a constant is expected");
        return { type: own.kind, value: (minus ? -1 : 1) * Number(own.text) };
    }
    function declarations() {
        for (;;) {
            const part = ["VAR", "VAR_INPUT", "VAR_OUTPUT"].find((kind) => taken(kind));
            if (part === undefined) return;
            const constant = taken("CONSTANT");
            while (!taken("END_VAR")) {
                const name = take("name").text;
                if (scope.variables[name] || RESERVED.includes(name) || STANDARD[name] || functions[name]) fail(`${name} is taken`);
                take(":");
                const { length, type } = arrayOrType();
                const zero = type.element === "BOOL" ? false : 0;
                let initial = length === null ? zero : new Array(length).fill(zero);
                if (taken(":=")) {
                    const one = () => { const own = signed(); same(own.type, type.element); return own.value; };
                    if (length === null) initial = one();
                    else {
                        take("[");
                        initial = [one()];
                        while (taken(",")) initial.push(one());
                        take("]");
                        if (initial.length !== length) fail(`${initial.length} entries for ${length} places`);
                    }
                } else if (constant) fail("a constant without a value");
                take(";");
                scope.variables[name] = { ...type, length, initial, written: !constant && part !== "VAR_INPUT", part };
            }
        }
    }
    // Expressions: the text in JavaScript, and the type.
    function primary() {
        if (taken("(")) { const own = expression(); take(")"); return { ...own, text: `(${own.text})` }; }
        if (taken("-")) { const own = primary(); if (own.type === "BOOL") fail("a sign before BOOL"); return { type: own.type, text: `(-${own.text})` }; }
        if (taken("NOT")) { const own = primary(); same(own.type, "BOOL"); return { type: "BOOL", text: `(!${own.text})` }; }
        if (taken("TRUE")) return { type: "BOOL", text: "true" };
        if (taken("FALSE")) return { type: "BOOL", text: "false" };
        if (peek() === "LREAL" || peek() === "DINT") { const own = list[at++]; return { type: own.kind, text: String(Number(own.text)) }; }
        const name = take("name").text;
        if (peek() === "(") {
            const [inputs, type] = STANDARD[name] ?? (functions[name] ? [functions[name].inputs, functions[name].type] : fail(`unknown function ${name}`));
            take("(");
            const given = [expression()];
            while (taken(",")) given.push(expression());
            take(")");
            if (given.length !== inputs.length) fail(`${name} takes ${inputs.length}`);
            given.forEach((own, place) => same(own.type, inputs[place]));
            return { type, text: `${STANDARD[name] ? "standard" : "functions"}.${name}(${given.map((own) => own.text).join(", ")})` };
        }
        return place(name);
    }
    function place(name) {
        const own = scope.variables[name] ?? fail(`undeclared ${name}`);
        if (own.block && taken(".")) {
            const inner = blocks[own.block].variables;
            const member = take("name").text;
            if (inner[member]?.part !== "VAR_OUTPUT") fail(`${member} is no output`);
            return reach(inner[member], `self.${name}.${member}`);
        }
        return reach(own, `self.${name}`);
    }
    function reach(own, text) {
        if (own.length === null || own.length === undefined) return { type: own.element, text, own };
        if (!taken("[")) return { type: `ARRAY ${own.length} ${own.element}`, text, own };
        const index = expression();
        same(index.type, "DINT");
        take("]");
        return { type: own.element, text: `${text}[inside(${index.text}, ${own.length})]`, own };
    }
    const levels = [
        [["OR", "||"]], [["AND", "&&"]], [["=", "==="], ["<>", "!=="]], [["<", "<"], [">", ">"], ["<=", "<="], [">=", ">="]],
        [["+", "+"], ["-", "-"]], [["*", "*"], ["/", "/"]],
    ];
    function expression(level = 0) {
        if (level === levels.length) return primary();
        let left = expression(level + 1);
        for (;;) {
            const found = levels[level].find(([kind]) => peek() === kind);
            if (found === undefined) return left;
            at += 1;
            const right = expression(level + 1);
            const type = same(left.type, right.type);
            if ((level < 2) !== (type === "BOOL")) fail(`${found[0]} of ${type}`);
            if (found[0] === "/" && type !== "LREAL") fail("a division of whole numbers");
            left = { type: level < 4 ? "BOOL" : type, text: `(${left.text} ${found[1]} ${right.text})` };
        }
    }
    function statements(...ends) {
        let text = "";
        while (!ends.includes(peek())) text += statement();
        return text;
    }
    function condition() { const own = expression(); same(own.type, "BOOL"); return own.text; }
    function statement() {
        if (taken("IF")) {
            let text = `if (${condition()}) {`;
            take("THEN");
            text += statements("ELSIF", "ELSE", "END_IF");
            while (taken("ELSIF")) { text += `} else if (${condition()}) {`; take("THEN"); text += statements("ELSIF", "ELSE", "END_IF"); }
            if (taken("ELSE")) text += `} else {${statements("END_IF")}`;
            take("END_IF");
            take(";");
            return text + "}\n";
        }
        if (taken("FOR")) {
            const counter = place(take("name").text);
            same(counter.type, "DINT");
            take(":=");
            const from = expression();
            take("TO");
            const to = expression();
            same(same(from.type, "DINT"), to.type);
            take("DO");
            const body = statements("END_FOR");
            take("END_FOR");
            take(";");
            // The counter after the loop is not defined; nobody may read it.
            return `{ const to = ${to.text}; for (${counter.text} = ${from.text}; ${counter.text} <= to; ${counter.text} += 1) {${body}} }\n`;
        }
        if (taken("WHILE")) {
            const own = condition();
            take("DO");
            const body = statements("END_WHILE");
            take("END_WHILE");
            take(";");
            return `while (${own}) {${body}}\n`;
        }
        const name = take("name").text;
        if (scope.variables[name]?.block && peek() === "(") {
            const inner = blocks[scope.variables[name].block].variables;
            take("(");
            let text = "";
            if (peek() !== ")") do {
                const input = take("name").text;
                if (inner[input]?.part !== "VAR_INPUT") fail(`${input} is no input`);
                take(":=");
                const own = expression();
                same(own.type, inner[input].length === null ? inner[input].element : `ARRAY ${inner[input].length} ${inner[input].element}`);
                text += `self.${name}.${input} = ${own.text.startsWith("self") && inner[input].length !== null ? `${own.text}.slice()` : own.text};`;
            } while (taken(","));
            take(")");
            take(";");
            return `${text} self.${name}.run();\n`;
        }
        const to = name === scope.result ? { type: scope.type, text: "self.result", own: { written: true } } : place(name);
        if (!to.own.written) fail(`${name} cannot be written`);
        take(":=");
        const own = expression();
        same(to.type, own.type);
        take(";");
        return `${to.text} = ${own.text};\n`;
    }
    function inside(index, length) {
        if (!(Number.isInteger(index) && index >= 0 && index < length)) throw new Error(`place ${index} of ${length}`);
        return index;
    }
    const standard = Object.fromEntries(Object.entries(STANDARD).map(([name, own]) => [name, own[2]]));
    const fresh = (variables) => Object.fromEntries(
        Object.entries(variables).map(([name, own]) => [name, own.block ? blocks[own.block].make() : Array.isArray(own.initial) ? own.initial.slice() : own.initial]),
    );
    while (peek() !== "end") {
        while (taken("TYPE")) {
            while (!taken("END_TYPE")) {
                const name = take("name").text;
                if (types[name] || RESERVED.includes(name)) fail(`${name} is taken`);
                take(":");
                const { length, type } = arrayOrType();
                types[name] = { ...type, length };
                take(";");
            }
        }
        const isFunction = taken("FUNCTION");
        if (!isFunction) take("FUNCTION_BLOCK");
        const name = take("name").text;
        scope = { variables: {} };
        if (isFunction) { take(":"); scope.result = name; scope.type = typeName().element; }
        declarations();
        const variables = scope.variables;
        const body = statements(isFunction ? "END_FUNCTION" : "END_FUNCTION_BLOCK");
        at += 1;
        const run = new Function("self", "standard", "functions", "inside", `"use strict";\n${body}`);
        if (isFunction) {
            const inputs = Object.entries(variables).filter(([, own]) => own.part === "VAR_INPUT");
            const own = (...given) => {
                const self = { ...fresh(variables), result: 0 };
                inputs.forEach(([input], place) => { self[input] = given[place]; });
                run(self, standard, functions, inside);
                return self.result;
            };
            functions[name] = Object.assign(own, { inputs: inputs.map(([, own]) => own.element), type: scope.type });
        } else {
            blocks[name] = {
                variables,
                make: () => {
                    const self = fresh(variables);
                    self.run = () => run(self, standard, functions, inside);
                    return self;
                },
            };
        }
    }
    return blocks;
}

module.exports = structuredText;
