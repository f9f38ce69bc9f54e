#!/usr/bin/env node
// Prints what an editor's JSON language server offers in files of tpm, from schemas/ alone.
//
//     npm install --prefix FOLDER vscode-json-languageservice
//     node scripts/schema_completion.mjs FOLDER
//
// The server is the library behind the JSON support of VS Code and of other editors.
import fs from 'fs';
import path from 'path';
import { createRequire } from 'module';

const folder = path.resolve(process.argv[2], 'index.js');
const { getLanguageService, TextDocument } = createRequire(folder)('vscode-json-languageservice');
const service = getLanguageService({
  workspaceContext: { resolveRelativePath: (relative, of) => new URL(relative, of).href },
  schemaRequestService: async (uri) => fs.readFileSync(new URL(uri), 'utf8'),
});
service.configure({ validate: true });

// Each document names its schema as the shipped files do. The cursor is at |.
const cases = [
  ['a key of a scene', 'scene', '"organ": {"kind": "liver"}, |'],
  ['the kind of an organ', 'scene', '"organ": {"kind": |}'],
  ['a key of a ramp', 'scene', '"protocol": {"kind": "ramp_hold", |}'],
  ['a key of a session', 'hil', '|'],
  ['a key of the noise of a fit', 'fit', '"data": [{"noise": {|}}]'],
  ['the scale of a parameter', 'fit', '"parameters": {"E": {"scale": |}}'],
  ['the drive of a law', 'law', '"drive": |'],
  ['a key of a sweep', 'sweep', '|'],
];
console.log('| the cursor stands at | offered |\n| --- | --- |');
for (const [words, name, text] of cases) {
  const marked = `{"$schema": "../schemas/${name}.schema.json", ${text}}`;
  const uri = new URL('../configs/file.json', import.meta.url).href;
  const document = TextDocument.create(uri, 'json', 1, marked.replace('|', ''));
  const offered = await service.doComplete(document, document.positionAt(marked.indexOf('|')), service.parseJSONDocument(document));
  console.log(`| ${words} | ${offered.items.map((item) => item.label.replaceAll('"', '')).join(', ')} |`);
}
for (const [name, text] of [['scene', '"organ": {"kind": "liver"}, "materal": {}'], ['fit', '"starts": {"count": 0}']]) {
  const uri = new URL('../configs/file.json', import.meta.url).href;
  const marked = `{"$schema": "../schemas/${name}.schema.json", ${text}}`;
  const document = TextDocument.create(uri, 'json', 1, marked);
  const found = await service.doValidation(document, service.parseJSONDocument(document));
  console.log(`\n${text}\n    ${found.map((one) => one.message).join(' ')}`);
}
