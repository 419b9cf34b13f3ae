// Khronos' validator on .glb files: node gltf.js FILE... (npm install gltf-validator, and NODE_PATH
// where it is). Fails on any error or warning.
const fs = require("fs");
let validator;
try {
    validator = require("gltf-validator");
} catch {
    console.log("skipped: no gltf-validator here");
    process.exit(0);
}
(async () => {
    for (const file of process.argv.slice(2)) {
        const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
        const { numErrors, numWarnings, numInfos, messages } = report.issues;
        console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} remarks`);
        for (const { severity, code, message, pointer } of messages) {
            if (severity < 2) console.log(`  ${code} ${pointer}: ${message}`);
        }
        if (numErrors + numWarnings > 0) process.exitCode = 1;
    }
})();
