// Prints what the npm package fhir finds in a FHIR R4 resource: node fhir.mjs FILE, with NODE_PATH set to the packages.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const { Fhir } = createRequire(import.meta.url)("fhir");
const found = new Fhir().validate(JSON.parse(readFileSync(process.argv[2], "utf8")), { errorOnUnexpected: true });
process.stdout.write(JSON.stringify(found));
