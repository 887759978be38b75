// Compiles WGSL files with Chrome's compiler: node tint.mjs FOLDER FILES... The folder holds node_modules/webgpu.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { pathToFileURL } from 'node:url';

const [folder, ...files] = process.argv.slice(2);
const path = createRequire(pathToFileURL(folder + '/')).resolve('webgpu');
const { create, globals } = await import(pathToFileURL(path));
Object.assign(globalThis, globals);
// Compiling needs no device: Dawn's null backend validates and runs nothing.
const gpu = create(['backend=null']);
const adapter = await gpu.requestAdapter();
if (!adapter) {
    console.error('there is no adapter');
    process.exit(1);
}
const device = await adapter.requestDevice();
let remarks = 0;
for (const file of files) {
    device.pushErrorScope('validation');
    const module = device.createShaderModule({ code: readFileSync(file, 'utf8') });
    const { messages } = await module.getCompilationInfo();
    const entryPoint = file.split(/[-/]/).pop().replace('.wgsl', '');
    await device.createComputePipelineAsync({ layout: 'auto', compute: { module, entryPoint } }).catch((error) => {
        messages.push({ type: 'error', lineNum: 0, message: error.message });
    });
    const error = await device.popErrorScope();
    for (const message of messages) {
        remarks += 1;
        console.error(`${file}:${message.lineNum}: ${message.type}: ${message.message}`);
    }
    if (error) {
        remarks += 1;
        console.error(`${file}: ${error.message}`);
    }
}
console.log(remarks === 0 ? `${files.length} files without a remark` : `${remarks} remarks`);
process.exit(remarks === 0 ? 0 : 1);
